/** Cars between two snapshots: from where they were drawn to where they are, so that 20 Hz looks smooth. */
import { live } from "scm/shell/store.js";

const GLIDE_MS = 60;
const JUMP_M = 0.3;

const shown = new Map();
let sequence = -1;
let from = new Map();

/** All cars where they should be drawn now. */
export function carsNow() {
  if (live.sequence !== sequence) {
    sequence = live.sequence;
    from = new Map(shown);
  }
  const share = Math.min(1, (performance.now() - live.at) / GLIDE_MS);
  shown.clear();
  return live.vehicles.map((car) => {
    const drawn = between(from.get(car.vehicle), car, share);
    shown.set(car.vehicle, drawn);
    return drawn;
  });
}

function between(start, end, share) {
  if (!start || Math.hypot(end.x_m - start.x_m, end.y_m - start.y_m) > JUMP_M) return end;
  const turn = Math.atan2(
    Math.sin(end.yaw_rad - start.yaw_rad),
    Math.cos(end.yaw_rad - start.yaw_rad),
  );
  return {
    ...end,
    x_m: start.x_m + share * (end.x_m - start.x_m),
    y_m: start.y_m + share * (end.y_m - start.y_m),
    yaw_rad: start.yaw_rad + share * turn,
  };
}
