/** Verdicts, units and numbers as the page says them. */
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

/** Parts of the model that an effect belongs to, as chips. */
export const PARTS = {
  drive: "Drive",
  steering: "Steering",
  tyre: "Tyres",
  body: "Body",
  surface: "Floor",
  sensor: "Measuring",
};

/** Errors of free runs by their names in a report: words, and the unit shown. */
const ERRORS = {
  position_m: ["Position", "m"],
  yaw_rad: ["Heading", "rad"],
  speed_mps: ["Speed", "m/s"],
  wheel_m: ["Wheels' way", "m"],
  gyro_rad: ["Turned, by the gyro", "rad"],
  accel_x_mps: ["Speed gained ahead, by the IMU", "m/s"],
  accel_y_mps: ["Speed gained sideways, by the IMU", "m/s"],
};

export function errorName(key) {
  const known = ERRORS[key];
  if (known) return { words: known[0], unit: known[1] };
  const unit = key.split("_").at(-1);
  return { words: key.slice(0, -unit.length - 1).replaceAll("_", " "), unit };
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

/** Values to be compared: all in one unit, that of the largest. */
export function alike(values, unit) {
  const most = Math.max(0, ...values.filter((value) => value !== null && value !== undefined).map(Math.abs));
  const [factor, name] = scaleOf(most, unit);
  return values.map((value) => (value === null || value === undefined ? UNKNOWN : `${digits(value * factor)} ${name}`));
}

function scaleOf(most, unit) {
  if (unit === "rad") return [180 / Math.PI, "°"];
  if (unit === "m") return most >= 1 ? [1, "m"] : most >= 0.01 ? [100, "cm"] : [1000, "mm"];
  if (unit === "m/s") return most >= 1 ? [1, "m/s"] : [100, "cm/s"];
  return [1, unitText(unit)];
}

function digits(value) {
  const size = Math.abs(value);
  return value.toFixed(size >= 100 ? 0 : size >= 10 ? 1 : 2);
}
