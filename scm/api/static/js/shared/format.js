/** Numbers and times as people read them; "—" stands for what is not known. */

export const UNKNOWN = "—";

/** @param {number | null | undefined} value */
export function fixed(value, digits, unit = "") {
  if (value === null || value === undefined) return UNKNOWN;
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text) + unit;  // a car that stands: not -0.00
}

/** Names in the order people count: n2 before n17. */
export const byName = new Intl.Collator("en", { numeric: true }).compare;

/** Events in the order in which they happened: a restarted server receives earlier ones in any order. */
export const newestFirst = (a, b) => b.t_ns - a.t_ns || b.seq - a.seq;

/** A name in plain words: south_east is "south east". */
export const spaced = (name) => name.replaceAll("_", " ");

/** An age or a span in seconds, short. */
export function span(seconds) {
  if (seconds === null || seconds === undefined) return UNKNOWN;
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 120) return `${Math.round(seconds)} s`;
  return `${Math.round(seconds / 60)} min`;
}

/** A car's age in milliseconds. */
export function age(ms) {
  return ms < 1000 ? `${Math.round(ms)} ms` : span(ms / 1000);
}

/** Wall time of a stamp; of a run on a stepped clock, the time since its start. */
export function clock(t_ns) {
  const ms = t_ns / 1e6;
  if (ms > 1e12) return new Date(ms).toTimeString().slice(0, 8);
  const s = ms / 1000;
  const two = (n) => String(Math.floor(n)).padStart(2, "0");
  return `${two(s / 3600)}:${two((s / 60) % 60)}:${two(s % 60)}`;
}

/** Wall time of a stamp, with its day where that is not today. */
export function moment(t_ns) {
  const at = new Date(t_ns / 1e6);
  const old = t_ns / 1e6 > 1e12 && at.toDateString() !== new Date().toDateString();
  return old ? `${at.toLocaleDateString("en-GB", { day: "numeric", month: "short" })} ${clock(t_ns)}` : clock(t_ns);
}
