/** Events that the stream sent since the log was opened, and whether any are missing. */
import { useRef } from "preact/hooks";
import { events } from "scm/shell/store.js";

/** The store holds only the last ones; with more than this the log is read again. */
const MOST = 1000;

/** How many acknowledgements the stream carries: the newest. */
const MAX_STREAMED = 500;

/**
 * All events since the log was opened, or was read anew.
 * @returns `{rows, missed}`; rows newest first; `missed()` returns whether the log has to be read again
 */
export function useLiveEvents() {
  const state = useRef({ rows: [], missed: false });
  const own = state.current;
  const newest = own.rows[0]?.seq ?? 0;
  const streamed = events.value;
  const fresh = streamed.filter((event) => event.seq > newest);
  const isAnew = streamed.length > 0 && streamed[0].seq < newest; // the server was started again
  const hasGap = newest > 0 && fresh.length > 0 && fresh.at(-1).seq > newest + 1;
  if (isAnew) state.current = { rows: streamed, missed: true };
  else if (fresh.length) state.current = { rows: [...fresh, ...own.rows], missed: own.missed || hasGap };
  const missed = () => {
    if (!state.current.missed && state.current.rows.length <= MOST) return false;
    state.current = { rows: events.value, missed: false };
    return true;
  };
  return { rows: state.current.rows, missed };
}

/**
 * Who acknowledged an event, as a function of its row: the stream has the newest acknowledgements, the row as it
 * was read has the earlier ones.
 * @param streamed acknowledgements, oldest first
 */
export function acknowledgedBy(streamed) {
  const known = new Map(streamed.map((row) => [row.event, row]));
  const since_ns = streamed.length < MAX_STREAMED ? 0 : streamed[0].at_ns;
  return (row) => {
    const own = known.get(row.id);
    if (own) return { acknowledged_by: own.by, acknowledged_ns: own.at_ns, note: own.note };
    return row.acknowledged_by && row.acknowledged_ns < since_ns ? {} : { acknowledged_by: null };
  };
}
