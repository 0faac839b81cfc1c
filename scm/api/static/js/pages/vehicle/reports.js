/** The last half minute of all that a car reports, its newest scan, and what a network makes of a frame; received while a page shows it. */
import { signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { subscribe, RANKS } from "scm/shell/streams.js";

export const SHOWN_S = 30;
const GAP_S = 0.5;
const DEGREES = 180 / Math.PI;

/** Columns of `Sample` in their order, angles in degrees; `t` counts from the newest report backwards. */
const NAMES = ["t", "throttle", "steering", "speed", "angle", "yawRate", "accel"];

/** Counts up with every frame that came. */
export const fresh = signal(0);

/** When the newest came, on this page's clock [ms]; likewise of `scan` and `network`. */
export const reportedAt = signal(-Infinity);
export const scannedAt = signal(-Infinity);
export const networkAt = signal(-Infinity);

/** The newest turn of its LIDAR: a `ScanRow`; null: none came yet, false: it has no LIDAR. */
export const scan = signal(null);

/** What a network that drives it made of a frame: the newest `NetworkView`; null: none came yet. */
export const network = signal(null);

let columns = empty();

function empty() {
  return Object.fromEntries(NAMES.map((name) => [name, []]));
}

/** The columns as they are now; nobody else writes them. */
export function reportsNow() {
  return columns;
}

/** Subscribe to a car's reports while the component is on the page. */
export function useReports(vehicle) {
  useEffect(() => {
    columns = empty();
    fresh.value += 1;
    scan.value = network.value = null;
    return subscribe(`/api/v1/vehicles/${vehicle}/reports?scan=true&network=true`, {
      network(newest) {
        network.value = newest;
        networkAt.value = performance.now();
      },
      scan(newest) {
        scan.value = newest ?? false;
        scannedAt.value = performance.now();
      },
      reports({ samples }) {
        samples.forEach(append);
        forget();
        fresh.value += 1;
        reportedAt.value = performance.now();
      },
    }, RANKS.car);
  }, [vehicle]);
}

function append([t, throttle, steering, speed, angle, yawRate, accel]) {
  const last = columns.t.at(-1);
  if (last !== undefined && t <= last) {
    if (last - t < 1) return; // late
    columns = empty(); // the car's clock began anew
  }
  if (t - last > GAP_S) NAMES.forEach((name) => columns[name].push(name === "t" ? last : null)); // no line over a gap
  const row = [t, throttle, steering, speed, angle * DEGREES, yawRate * DEGREES, accel];
  NAMES.forEach((name, i) => columns[name].push(row[i]));
}

function forget() {
  const first = columns.t.findIndex((t) => t >= columns.t.at(-1) - SHOWN_S);
  if (first > 100) for (const name of NAMES) columns[name].splice(0, first);
}
