/** Verdicts, units and numbers as the page writes them. */
import { UNKNOWN } from "scm/shared/format.js";

export const VERDICTS = {
  mismatch: { word: "Mismatch", sign: "▲" },
  undecided: { word: "Undecided", sign: "?" },
  none: { word: "No mismatch", sign: "✓" },
  unreadable: { word: "Unreadable", sign: "✕" },
};

/** How a report's verdict is shown: nothing found in too short a time is no clean bill. */
export function verdictOf(row) {
  if (row.verdict === "none" && row.cut_short) return { kind: "undecided", word: "Time ran out", sign: "?" };
  const kind = row.verdict in VERDICTS ? row.verdict : "unreadable";
  return { kind, ...VERDICTS[kind] };
}

export const unitText = (unit) => (unit === "1" ? "" : unit.replaceAll("*", "·").replace("^2", "²"));

/** Three digits, without an exponent where people would write none. */
export function short(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return UNKNOWN;
  const size = Math.abs(value);
  const text = size !== 0 && (size < 1e-4 || size >= 1e6) ? value.toExponential(1) : String(Number(value.toPrecision(3)));
  return text.replace("-", "−");
}

/** A length in the unit that suits it. */
export function length(metres) {
  if (metres === null || metres === undefined) return UNKNOWN;
  if (Math.abs(metres) >= 1) return `${short(metres)} m`;
  return Math.abs(metres) >= 0.01 ? `${short(100 * metres)} cm` : `${short(1000 * metres)} mm`;
}
