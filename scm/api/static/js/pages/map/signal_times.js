/** When a signal changes, in as few words as hold: a time, or two, or a forecast and how far to trust it. */

const NARROW_S = 0.5; // a guaranteed time this narrow is one time: the later, so that nobody starts early

/**
 * The time to change of a group's row, `passed_s` after it was published.
 * @returns e.g. `4 s`, `3–9 s`, `≈6 s 80 %`; empty: nothing is known.
 */
export function timeToChange(group, passed_s) {
  if (!group || group.min_s === null || group.min_s === undefined) return "";
  const [min, max, likely] = [group.min_s, group.max_s, group.likely_s].map((time) =>
    time === null || time === undefined ? null : Math.max(0, time - passed_s),
  );
  if (max !== null && max - min <= NARROW_S) return `${Math.ceil(max)} s`;
  if (likely !== null) {
    const trust = group.likely_confidence;
    return `≈${Math.round(likely)} s${trust === null ? "" : ` ${Math.round(100 * trust)} %`}`;
  }
  if (max === null) return `>${Math.floor(min)} s`;
  return `${Math.floor(min)}–${Math.ceil(max)} s`;
}
