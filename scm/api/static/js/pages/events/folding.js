/** Repeats folded: a hundred hard brakings of a busy city are one row with a count, not a hundred rows. */

const GAP_NS = 300e9;

/**
 * Group events of a kind, that is of one source, name and severity: about any car, each within five minutes of
 * the next; about no car, while the source repeats the same text and nothing else. Errors stand alone.
 * @param events newest first
 * @returns groups newest first: `{key, newest, oldest, events, vehicles}`; vehicles newest first, each once
 */
export function folded(events) {
  const groups = [];
  const open = new Map();
  for (const event of events) {
    const { severity, source, name, vehicle, text } = event;
    const isOfCar = vehicle !== null && vehicle !== undefined;
    const groupKey = isOfCar ? [severity, source, name].join("/") : source;
    const group = severity === "error" ? undefined : open.get(groupKey);
    const isAgain = isOfCar || (group?.newest.text === text && group?.newest.severity === severity);
    if (group && isAgain && group.oldest.t_ns - event.t_ns <= GAP_NS) {
      group.events.push(event);
      group.oldest = event;
      if (isOfCar && !group.vehicles.includes(vehicle)) group.vehicles.push(vehicle);
      continue;
    }
    const vehicles = isOfCar ? [vehicle] : [];
    const begun = { key: event.id, newest: event, oldest: event, events: [event], vehicles };
    groups.push(begun);
    open.set(groupKey, begun);
  }
  return groups;
}

/** Each event as a group of its own: nothing is folded. */
export const single = (events) =>
  events.map((event) => ({
    key: event.id,
    newest: event,
    oldest: event,
    events: [event],
    vehicles: event.vehicle ? [event.vehicle] : [],
  }));
