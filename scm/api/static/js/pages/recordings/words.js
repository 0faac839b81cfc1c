/** Times and sizes of recordings, in words. */

/** 83.4 s is `1:23.4`; without tenths `1:23`. */
export function minutes(seconds, tenths = false) {
  const whole = tenths ? Math.round(seconds * 10) / 10 : Math.floor(seconds);
  const rest = whole % 60;
  const hours = Math.floor(whole / 3600);
  const minute = Math.floor(whole / 60) % 60;
  const tail = (tenths ? rest.toFixed(1) : String(rest)).padStart(tenths ? 4 : 2, "0");
  return hours ? `${hours}:${String(minute).padStart(2, "0")}:${tail}` : `${minute}:${tail}`;
}

/** 3683.4 s is `1 h 1 min 23 s`. */
export function spoken(seconds) {
  const whole = Math.round(seconds);
  const [hours, minute] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60];
  return `${hours ? `${hours} h ` : ""}${hours || minute ? `${minute} min ` : ""}${whole % 60} s`;
}

export function size(bytes) {
  if (bytes < 1e3) return `${bytes} B`;
  const [value, unit] = bytes < 1e6 ? [bytes / 1e3, "kB"] : bytes < 1e9 ? [bytes / 1e6, "MB"] : [bytes / 1e9, "GB"];
  return `${value.toFixed(value < 10 ? 1 : 0)} ${unit}`;
}

const DAY = new Intl.DateTimeFormat("en-GB", { day: "numeric", month: "short", year: "numeric" });
const TIME = new Intl.DateTimeFormat("en-GB", { hour: "2-digit", minute: "2-digit", second: "2-digit" });

/** `23 Nov 2026, 03:18:41`, here; a run on a stepped clock has no date. */
export function moment(t_ns) {
  const ms = t_ns / 1e6;
  return ms > 1e12 ? `${DAY.format(ms)}, ${TIME.format(ms)}` : "on a stepped clock";
}

export function timeOfDay(t_ns) {
  const ms = t_ns / 1e6;
  return ms > 1e12 ? TIME.format(ms) : "";
}
