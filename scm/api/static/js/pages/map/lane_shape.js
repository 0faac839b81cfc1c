/** Where a lane lies: straights and arcs from its start, as in the map file. */

export const lengthOf = ({ length_m, radius_m, angle_rad }) => length_m ?? radius_m * Math.abs(angle_rad);

const curvatureOf = ({ radius_m, angle_rad }) => (radius_m ? Math.sign(angle_rad) / radius_m : 0);

/** The pose on a lane's centre line, so far from its start [m]. */
export function along(lane, s) {
  const [x, y, yaw] = lane.start;
  let pose = { x, y, yaw };
  for (const segment of lane.segments) {
    const length = Math.min(lengthOf(segment), s);
    pose = moved(pose, length, curvatureOf(segment));
    s -= length;
  }
  return pose;
}

/** The pose after a way of constant curvature, + = left. */
export function moved({ x, y, yaw }, length, curvature) {
  const turn = curvature * length;
  const chord = turn ? (2 * Math.sin(turn / 2)) / curvature : length;
  const way = yaw + turn / 2;
  return { x: x + chord * Math.cos(way), y: y + chord * Math.sin(way), yaw: yaw + turn };
}

/** The pose of a car's rear axle at a spawn place of a map. */
export function spawnPose(map, { pose, lane, at_m }) {
  if (!pose) return along(map.lanes.find(({ name }) => name === lane), at_m ?? 0);
  const [x, y, yaw] = pose;
  return { x, y, yaw };
}

/** The lane whose centre line is nearest to a place, within half its width or `reach` [m]; null: none is. */
export function laneAt(lanes, x, y, reach) {
  let best = null;
  let nearest = Infinity;
  for (const lane of lanes) {
    const far = distanceTo(lane, x, y);
    if (far < nearest && far <= Math.max(reach, lane.width_m / 2)) [best, nearest] = [lane, far];
  }
  return best;
}

/** How far a place is from a lane's centre line [m]. */
function distanceTo(lane, x, y) {
  const [x0, y0, yaw0] = lane.start;
  let pose = { x: x0, y: y0, yaw: yaw0 };
  let nearest = Infinity;
  for (const segment of lane.segments) {
    const [length, curvature] = [lengthOf(segment), curvatureOf(segment)];
    const foot = moved(pose, footOf(pose, length, curvature, x, y), curvature);
    nearest = Math.min(nearest, Math.hypot(foot.x - x, foot.y - y));
    pose = moved(pose, length, curvature);
  }
  return nearest;
}

/** How far along a straight or an arc the point nearest to a place lies [m]. */
function footOf({ x: x0, y: y0, yaw }, length, curvature, x, y) {
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  const [u, v] = [c * (x - x0) + s * (y - y0), c * (y - y0) - s * (x - x0)];
  if (!curvature) return Math.min(Math.max(u, 0), length);
  const whole = (2 * Math.PI) / Math.abs(curvature);
  const at = Math.atan2(curvature * u, 1 - curvature * v) / curvature;
  const ahead = (at + whole) % whole;
  if (ahead <= length) return ahead;
  return ahead - length < whole - ahead ? length : 0; // beyond the arc: its nearer end
}
