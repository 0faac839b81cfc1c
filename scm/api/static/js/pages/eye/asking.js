/** Reading from the interface: once, again and again, and until an operation is over. */
import { useEffect, useState } from "preact/hooks";

/** @returns the body; throws a sentence where the city says no. */
export async function read(path) {
  const response = await fetch(`/api/v1${path}`).catch(() => {
    throw new Error("The city's server does not answer; it is asked again.");
  });
  const body = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error(body.detail || body.title || `${path}: ${response.status}`);
  return body;
}

/** Read a path every so often for as long as the component is there: `{body, error, again}`. */
export function usePolled(path, period_ms) {
  const [told, setTold] = useState({ body: null, error: "" });
  const [turn, setTurn] = useState(0);
  useEffect(() => {
    let over = false;
    let timer = null;
    const look = async () => {
      try {
        const body = await read(path);
        if (!over) setTold({ body, error: "" });
      } catch (error) {
        if (!over) setTold((before) => ({ ...before, error: error.message }));
      }
      if (!over && period_ms) timer = setTimeout(look, period_ms);
    };
    look();
    return () => {
      over = true;
      clearTimeout(timer);
    };
  }, [path, period_ms, turn]);
  return { ...told, again: () => setTurn((before) => before + 1) };
}

const OVER = ["done", "failed", "cancelled"];

/** Look at an operation until it is over; `tell` hears each state. */
export async function finished(operation, tell) {
  let row = operation;
  tell(row);
  while (!OVER.includes(row.state)) {
    await new Promise((resolve) => setTimeout(resolve, 250));
    row = await read(`/operations/${row.id}`).catch(() => row); // the link may break: it is asked again
    tell(row);
  }
  return row;
}
