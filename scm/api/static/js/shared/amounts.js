/** Numbers of car files whose names end in their unit, as people read them: `offset_rad` as an offset in degrees. */

/** Endings of names, longer ones first. */
const UNITS = [
  ["_rad_s", "rad/s"], ["_radps", "rad/s"], ["_mps2", "m/s²"], ["_mps", "m/s"], ["_per_min", "1/min"],
  ["_rad", "rad"], ["_kg", "kg"], ["_nm", "N·m"], ["_n", "N"], ["_m", "m"], ["_s", "s"], ["_v", "V"],
];

/** From how large a value on [SI], in which unit, and how many of it one SI unit is. */
const DEGREES = 180 / Math.PI;
const SCALES = {
  m: [[1, " m", 1], [0.01, " cm", 100], [0, " mm", 1000]],
  s: [[1, " s", 1], [0, " ms", 1000]],
  kg: [[1, " kg", 1], [0, " g", 1000]],
  rad: [[0, "°", DEGREES]],
  "rad/s": [[0, "°/s", DEGREES]],
};

/** The name without its unit, in words. */
export function nameOf(name) {
  const [ending = ""] = UNITS.find(([one]) => name.endsWith(one)) ?? [];
  return name.slice(0, name.length - ending.length).replaceAll("_", " ");
}

/**
 * Values of one number, all in the unit that suits the largest.
 * @param values null: unknown
 * @param unit of a name that does not end in one
 * @param width what the digits have to show: of an interval, say; 0: three digits of the largest
 */
export function amounts(name, values, { unit = "", width = 0 } = {}) {
  const known = values.filter((value) => value !== null).map(Math.abs);
  const most = Math.max(0, ...known);
  const own = UNITS.find(([one]) => name.endsWith(one))?.[1] ?? printed(unit);
  const scales = SCALES[own] ?? [[0, own && ` ${own}`, 1]];
  const [, words, factor] = scales.find(([least]) => most >= least);
  const finest = width ? (width * factor) / 10 : (most * factor) / 100;
  const digits = finest > 0 ? Math.min(6, Math.max(0, -Math.floor(Math.log10(finest)))) : 0;
  return values.map((value) => value === null ? "—" : signed((value * factor).toFixed(digits)) + words);
}

const printed = (unit) => (unit === "1" ? "" : unit.replaceAll("*", "·").replace("^2", "²"));

const signed = (text) => (Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−"));

/** A probability in percent, never 0 or 100. */
export function percent(share) {
  if (share > 0.999) return "over 99.9 %";
  if (share < 0.001) return "under 0.1 %";
  return `${(100 * share).toFixed(share > 0.985 || share < 0.01 ? 1 : 0)} %`;
}
