/** Cars that park themselves: what their agents report, and how to say it. */
import { topic } from "scm/shell/store.js";

const WORDS = {
  idle: "Waits",
  map: "Builds a map",
  localise: "Finds out where it is",
  plan: "Looks for a path",
  drive: "Drives to its goal",
  recover: "Stands",
  parked: "Parked",
  failed: "Gave up",
};

/** The row of a car in the topic `autonomy`; null: no agent parks it. */
export const autonomyOf = (name) => topic("autonomy").value?.find(({ vehicle }) => vehicle === name) ?? null;

/** What a car does, and why. */
export const stateInWords = ({ state, reason }) => `${WORDS[state]}${reason ? `: ${reason}` : ""}`;
