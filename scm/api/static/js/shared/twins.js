/** Cars that the twin part watches: their rows of the live stream, and how to say them. */
import { span } from "scm/shared/format.js";
import { topic } from "scm/shell/store.js";

export const STATES = { learning: "Learning", watching: "Watching", blind: "Blind" };

/** The rows of all watched cars; null: nothing was received yet. */
export const twinRows = () => topic("twins").value;

/** The row of a car; null: nobody watches it. */
export const twinOf = (name) => twinRows()?.find(({ vehicle }) => vehicle === name) ?? null;

/** How long ago something was, by the clock of a car's reports. */
export const ago = (then_ns, now_ns) => `${span(Math.max(0, (now_ns - then_ns) / 1e9))} ago`;

/** A car in one line. */
export function twinInWords({ state, reason, version, changed_ns, newest, t_ns }) {
  const words = [state.toLowerCase() + (reason ? ` (${reason})` : ""), `version ${version}`];
  words.push(changed_ns === null ? "no change noticed" : `changed ${ago(changed_ns, t_ns)}: ${newest}`);
  return words.join(", ");
}
