/** Reading from the server, again and again where a page shows what changes. */
import { useEffect, useState } from "preact/hooks";
import { placed } from "scm/shared/base.js";

/** @returns {Promise<{body, etag}>} a resource; rejects with the server's sentence. */
export async function read(path) {
  const response = await fetch(placed(`/api/v1${path}`));
  const body = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error(body.detail || body.title || `${path}: ${response.status}`);
  return { body, etag: response.headers.get("ETag") };
}

/**
 * Read now, and every so often; what was read stays while the next answer is on its way.
 * @returns `{body, error, again}`: `body` null until the first answer, `again` reads at once.
 */
export function useReading(path, every_ms = 0) {
  const [state, setState] = useState({ body: null, error: "" });
  const [turn, setTurn] = useState(0);
  useEffect(() => {
    let over = false;
    let timer = null;
    const look = async () => {
      const found = await read(path).then(
        ({ body }) => ({ body, error: "" }),
        (error) => ({ error: error.message }),
      );
      if (over) return;
      setState((before) => ({ ...before, ...found }));
      if (every_ms) timer = setTimeout(look, every_ms);
    };
    look();
    return () => {
      over = true;
      clearTimeout(timer);
    };
  }, [path, every_ms, turn]);
  return { ...state, again: () => setTurn((count) => count + 1) };
}
