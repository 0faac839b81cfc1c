/** A call of the web and what it led to, as one row of the audit. */

/**
 * Put a call of the web and what a part of the city did for it into one: both note it, each what it knows.
 * @param rows entries of the audit, newest first; a call is noted once it is answered
 * @returns `[{row, call}]`; call null: the entry came another way, or its call is not among the rows
 */
export function folded(rows) {
  const callOf = new Map();
  const open = new Map(); // by trace: the call that has no entry of a part yet
  for (const row of rows) {
    if (row.station === "api") {
      open.set(row.trace_id, row);
    } else if (open.has(row.trace_id)) {
      callOf.set(row, open.get(row.trace_id));
      open.delete(row.trace_id);
    }
  }
  const matched = new Set(callOf.values());
  return rows.filter((row) => !matched.has(row)).map((row) => ({ row, call: callOf.get(row) ?? null }));
}
