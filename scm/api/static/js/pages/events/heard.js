/** What the stream told the log of events: kept for as long as the log is open, and whether some is missing. */
import { useRef } from "preact/hooks";
import { events } from "scm/shell/store.js";

/** The store keeps the last ones alone; with more than this the log is read anew. */
const MOST = 1000;

/** How many acknowledgements the stream carries: the newest. */
const ACKNOWLEDGED_TOLD = 500;

/**
 * All events since the log was opened, or was read anew.
 * @returns `{rows, missed}`; rows newest first; `missed()` tells that the log has to be read anew
 */
export function useHeard() {
  const kept = useRef({ rows: [], missed: false });
  const own = kept.current;
  const newest = own.rows[0]?.seq ?? 0;
  const told = events.value;
  const fresh = told.filter((event) => event.seq > newest);
  const isAnew = told.length > 0 && told[0].seq < newest; // the server was started again
  const hasGap = newest > 0 && fresh.length > 0 && fresh.at(-1).seq > newest + 1;
  if (isAnew) kept.current = { rows: told, missed: true };
  else if (fresh.length) kept.current = { rows: [...fresh, ...own.rows], missed: own.missed || hasGap };
  const missed = () => {
    if (!kept.current.missed && kept.current.rows.length <= MOST) return false;
    kept.current = { rows: events.value, missed: false };
    return true;
  };
  return { rows: kept.current.rows, missed };
}

/**
 * Who took note of an event, as a function of its row: the stream tells the newest, the row as it was read
 * knows what was before them.
 * @param told acknowledgements, oldest first
 */
export function acknowledgedBy(told) {
  const known = new Map(told.map((row) => [row.event, row]));
  const since_ns = told.length < ACKNOWLEDGED_TOLD ? 0 : told[0].at_ns;
  return (row) => {
    const own = known.get(row.id);
    if (own) return { acknowledged_by: own.by, acknowledged_ns: own.at_ns, note: own.note };
    return row.acknowledged_by && row.acknowledged_ns < since_ns ? {} : { acknowledged_by: null };
  };
}
