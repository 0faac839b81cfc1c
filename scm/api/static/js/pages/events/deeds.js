/** Deeds of the audit in words: what somebody asked of the world, the signals, the monitor or the web. */
import { span, spaced } from "scm/shared/format.js";

const LEASES = { acquire: "take", renew: "keep", release: "give back", steal: "take from its owner" };
const names = (list) => list.map(spaced).join(", ");

const SAYINGS = {
  StopRequest: ({ engaged }) => (engaged ? "stop the city" : "release the city stop"),
  MonitorReset: ({ junction }) => `reset the monitor of ${spaced(junction)}`,
  PlanRequest: ({ junction, plan }) => `${plan === "flash" ? "flash red" : `run ${spaced(plan)}`} at ${spaced(junction)}`,
  SignalRequest: wished,
  JoinRequest: ({ vehicle, kind, car }) => `join as ${vehicle}, a ${kind} ${car}`,
  LeaseRequest: ({ vehicle, verb }) => `${LEASES[verb] ?? verb} the wheel of ${vehicle}`,
  SpawnRequest: ({ vehicle, car }) => `add ${vehicle || "a car"}, a ${car}`,
  RemoveRequest: ({ vehicle }) => `take ${vehicle} off the map`,
  RouteRequest: ({ vehicle, via }) => `send ${vehicle} ${via.length ? `through ${names(via)}` : "on its way"}`,
  unreadable: () => "what stands here is no entry: somebody changed it",
  LightRequest: ({ vehicle }) => `set the lights of ${vehicle}`,
};

function wished({ junction, verb, groups, policy, clears, expires_s }) {
  const what = [verb === "clear" ? `take back ${clears || "wishes"}` : spaced(verb), spaced(policy), names(groups)];
  const lasts = verb === "clear" ? "" : ` for ${span(expires_s)}`;
  return `${what.filter(Boolean).join(" ")} at ${spaced(junction)}${lasts}`;
}

/**
 * One deed as a sentence; of the web, the request itself. An entry that is not as it was written, by an
 * older city or by somebody who changed it, is called by its kind.
 */
export function said({ station, kind, request }) {
  if (station === "api") return kind.replace("/api/v1/", "/") + (request.query ? `?${request.query}` : "");
  try {
    return SAYINGS[kind]?.(request) ?? kind;
  } catch {
    return kind;
  }
}

/**
 * Put a call of the web and what a part of the city did for it into one: both note it, each what it knows.
 * @param rows entries of the audit, newest first; a call is noted once it is answered
 * @returns `[{row, call}]`; call null: the deed came another way, or its call is not among the rows
 */
export function folded(rows) {
  const callOf = new Map();
  const open = new Map(); // by trace: the call that has no deed yet
  for (const row of rows) {
    if (row.station === "api") {
      open.set(row.trace_id, row);
    } else if (open.has(row.trace_id)) {
      callOf.set(row, open.get(row.trace_id));
      open.delete(row.trace_id);
    }
  }
  const taken = new Set(callOf.values());
  return rows.filter((row) => !taken.has(row)).map((row) => ({ row, call: callOf.get(row) ?? null }));
}
