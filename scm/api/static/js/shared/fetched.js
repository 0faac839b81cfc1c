/** Data of the server: read once, or repeatedly while the page is visible. */
import { useCallback, useEffect, useState } from "preact/hooks";
import { placed } from "scm/shared/base.js";

/** @returns `{body, error, again}`: null until it came, and a function that reads it anew. */
export function useFetched(path, every_ms = 0) {
  const [found, setFound] = useState({ body: null, error: null });
  const [count, setCount] = useState(0);
  const again = useCallback(() => setCount((before) => before + 1), []);
  useEffect(() => {
    if (!path) return undefined;
    const quit = new AbortController();
    let next = null;
    read(path, quit.signal)
      .then(
        (body) => quit.signal.aborted || setFound({ body, error: null }),
        (error) => quit.signal.aborted || setFound((before) => ({ ...before, error: error.message })),
      )
      .then(() => {
        // After the answer: requests would pile up at a server that takes longer.
        if (every_ms && !quit.signal.aborted) next = setTimeout(again, every_ms);
      });
    return () => {
      clearTimeout(next);
      quit.abort();
    };
  }, [path, count, every_ms]);
  return { ...found, again };
}

async function read(path, signal) {
  const response = await fetch(placed(`/api/v1${path}`), { signal });
  if (response.ok) return response.json(); // of which a part may not come: that is an error
  const body = await response.json().catch(() => ({}));
  throw new Error(body.detail || body.title || `${path}: ${response.status}`);
}
