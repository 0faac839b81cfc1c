/** Reading from the interface, once or repeatedly. */
import { useEffect, useState } from "preact/hooks";
import { placed } from "scm/shared/base.js";
import { isOver } from "scm/shared/operation.js";

/** @returns the body; throws a sentence when the city refuses. */
export async function read(path) {
  const response = await fetch(placed(`/api/v1${path}`)).catch(() => {
    throw new Error("The city's server does not answer; trying again.");
  });
  const body = await response.json().catch(() => ({}));
  if (response.ok) return body;
  throw Object.assign(new Error(body.detail || body.title || `${path}: ${response.status}`), { status: response.status });
}

/** Read a path repeatedly while the component is mounted: `{body, error, again}`. */
export function usePolled(path, period_ms) {
  const [answer, setAnswer] = useState({ body: null, error: "" });
  const [turn, setTurn] = useState(0);
  useEffect(() => {
    let over = false;
    let timer = null;
    const look = async () => {
      try {
        const body = await read(path);
        if (!over) setAnswer({ body, error: "" });
      } catch (error) {
        if (!over) setAnswer((before) => ({ ...before, error: error.message }));
      }
      if (!over && period_ms) timer = setTimeout(look, period_ms);
    };
    look();
    return () => {
      over = true;
      clearTimeout(timer);
    };
  }, [path, period_ms, turn]);
  return { ...answer, again: () => setTurn((before) => before + 1) };
}

/** Follow an operation that still runs when the page is opened: the person who started it may have come back. */
export function useUnfinished(titles, follow) {
  useEffect(() => {
    let over = false;
    read("/operations?limit=100").then(
      ({ items }) => {
        const row = items.find((one) => one.kind === "calibration" && titles.includes(one.what) && !isOver(one));
        if (row && !over) follow(row);
      },
      () => {},
    );
    return () => (over = true);
  }, []);
}

/** Name of the calibration that an operation saved; empty: it saved none, or failed. */
export function savedBy({ state, result }) {
  return state === "done" && result.includes("/calibrations/") ? result.split("/").at(-1) : "";
}
