/** Rows of a long list: the first page by REST, more on demand, and what went wrong in words. */
import { useEffect, useRef, useState } from "preact/hooks";
import { placed } from "scm/shared/base.js";

const PAGE = 200;

/**
 * Hear a list of the server, newest first.
 * @param path below /api/v1
 * @param query its filter, as an object; what is empty is left out
 * @returns `{rows, more, error, loading, loadMore, reload}`; `more` is whether there are older ones
 */
export function useRows(path, query) {
  const search = new URLSearchParams(Object.entries(query).filter(([, value]) => value)).toString();
  const [state, setState] = useState({ rows: [], next: null, error: "", loading: true });
  const turn = useRef(0);

  async function load(cursor, before) {
    const own = ++turn.current;
    setState((state) => ({ ...state, loading: true, error: "" }));
    const more = cursor ? `&cursor=${encodeURIComponent(cursor)}` : "";
    try {
      const response = await fetch(placed(`/api/v1${path}?limit=${PAGE}&${search}${more}`));
      const body = await response.json();
      if (own !== turn.current) return; // another filter was chosen meanwhile
      if (!response.ok) throw new Error(body.detail || body.title);
      setState({ rows: [...before, ...body.items], next: body.next, error: "", loading: false });
    } catch (error) {
      if (own === turn.current) setState({ rows: before, next: null, error: error.message, loading: false });
    }
  }

  useEffect(() => void load(null, []), [path, search]);
  return {
    ...state,
    more: state.next !== null,
    query: search,
    loadMore: () => load(state.next, state.rows),
    reload: () => load(null, []),
  };
}

/** A debounced value: typing sends one request, not one for each letter. */
export function useRested(value, rest_ms = 250) {
  const [rested, setRested] = useState(value);
  useEffect(() => {
    const timer = setTimeout(() => setRested(value), rest_ms);
    return () => clearTimeout(timer);
  }, [value]);
  return rested;
}
