/** Repeats folded: a car that scrapes along a wall is one row with a count, not forty rows. */

const GAP_NS = 10e9;

/**
 * @param events newest first
 * @returns groups newest first: `{key, newest, events}`, all of one source, name, vehicle and severity,
 *   each within ten seconds of the next; what another event of that kind interrupts stays apart.
 */
export function folded(events) {
  const groups = [];
  const open = new Map();
  for (const event of events) {
    const kind = [event.severity, event.source, event.name, event.vehicle].join("/");
    const group = event.vehicle === null ? undefined : open.get(kind);
    const oldest = group?.events.at(-1);
    if (group && oldest.t_ns - event.t_ns <= GAP_NS) {
      group.events.push(event);
      continue;
    }
    const begun = { key: event.id, newest: event, events: [event] };
    groups.push(begun);
    open.set(kind, begun);
  }
  return groups;
}
