/** Data of the server: read once, or repeatedly while a component is mounted. */
import { useCallback, useEffect, useState } from "preact/hooks";
import { placed } from "scm/shared/base.js";

/** @returns {Promise<{body, etag}>} a resource; rejects with the server's sentence. */
export async function read(path, signal) {
  const response = await fetch(placed(`/api/v1${path}`), { signal }).catch(unreached);
  if (response.ok) return { body: await response.json(), etag: response.headers.get("ETag") }; // cut off: an error, not `{}`
  const problem = await response.json().catch(() => ({}));
  throw new Error(problem.detail || problem.title || `${path}: ${response.status}`);
}

export async function readBody(path) {
  return (await read(path)).body;
}

/** The browser's own message is for programmers; that a request was ended on purpose is for its caller. */
export function unreached(error) {
  if (error.name === "AbortError") throw error;
  throw new Error(error.name === "TimeoutError" ? "The city did not answer in time." : "The city cannot be reached.");
}

/**
 * Read now, and every so often; what was read stays while the next answer is on its way.
 * @returns `{body, error, again}`: null until it came, and a function that reads it anew.
 */
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
        ({ body }) => quit.signal.aborted || setFound({ body, error: null }),
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
