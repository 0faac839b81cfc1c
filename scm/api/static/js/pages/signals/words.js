/** Colours of signals in letters, words and signs, and guaranteed times. */
import { spaced, UNKNOWN } from "scm/shared/format.js";

export const LETTERS = { red: "R", yellow: "Y", green: "G", flashing_red: "F", dark: "D" };

export const WORDS = {
  red: "red",
  yellow: "yellow",
  green: "green",
  flashing_red: "flashing red",
  dark: "dark",
};

export const VERBS = {
  call: "Call",
  hold: "Hold",
  force_off: "Force off",
  omit: "Omit",
  preempt: "Pre-empt",
  policy: "Policy",
};

/** A guaranteed time this narrow is shown as one time: the later one, so that nobody starts early. */
const NARROW_S = 0.5;

/** A guaranteed time is shown as published: as one time, as a range, or as "not before". */
export function guaranteed({ min_s, max_s }, passed_s) {
  if (min_s === null) return UNKNOWN;
  const left = (seconds) => Math.max(0, seconds - Math.max(0, passed_s)).toFixed(1);
  if (max_s === null) return `≥ ${left(min_s)} s`;
  if (max_s - min_s <= NARROW_S) return `${left(max_s)} s`;
  const whole = (text) => (Number(text) < 10 ? text : Math.round(text));
  return `${whole(left(min_s))}–${whole(left(max_s))} s`;
}

/** Names of groups in plain words. */
export const plain = spaced;

/** What was requested and is not yet in force. */
export const toCome = (pending, mode) =>
  `${plain(pending)} begins ${mode === "flash" ? "when the flash ends" : "at the next safe moment"}`;

/** A number of seconds, without needless digits. */
export const secs = (value) => `${Number(value.toFixed(1))} s`;
