/** Calibrations that still run when the page is opened, and what one that ended has saved. */
import { useEffect } from "preact/hooks";
import { readBody } from "scm/shared/fetched.js";
import { isOver } from "scm/shared/operation.js";

/** Follow an operation that still runs when the page is opened: the person who started it may have come back. */
export function useUnfinished(titles, follow) {
  useEffect(() => {
    let over = false;
    readBody("/operations?limit=100").then(
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
