/** What the chosen car sees and plans: its LIDAR scans and its path, received while they are shown. */
import { effect, signal } from "@preact/signals";
import { selected } from "scm/shared/selection.js";
import { subscribe, RANKS } from "scm/shell/streams.js";
import { fleet } from "scm/pages/map/fleet.js";
import { layers } from "scm/pages/map/layers.js";
import { placed } from "scm/shared/base.js";

const PATH_MS = 700;

/** The newest of each; null: none. `scan` and `path` are bodies of the REST resources of these names. */
export const closeUp = { scan: null, scanAt: -Infinity, path: null };

/** The chosen car, once it is known that it has no LIDAR; else null. */
export const blind = signal(null);

/** Subscribe to what the visible layers need; returns the function that ends it. */
export function subscribeCloseUp() {
  const ends = [
    effect(() => {
      if (layers.value.lidar && selected.value) return subscribeScans(selected.value);
    }),
    effect(() => {
      if (layers.value.path && selected.value) return pollPaths(selected.value);
    }),
  ];
  return () => ends.forEach((end) => end());
}

function subscribeScans(vehicle) {
  const show = (scan) => {
    Object.assign(closeUp, { scan, scanAt: performance.now() });
    blind.value = scan ? null : vehicle;
  };
  const end = subscribe(`/api/v1/vehicles/${vehicle}/scan/stream`, { scan: show }, RANKS.view);
  return () => {
    end();
    closeUp.scan = blind.value = null;
  };
}

function pollPaths(vehicle) {
  let ended = false;
  const poll = async () => {
    if (!fleet.rows.has(vehicle)) return; // it left
    const response = await fetch(placed(`/api/v1/vehicles/${vehicle}/path`)).catch(() => null);
    const path = response?.ok ? await response.json().catch(() => null) : null;
    if (!ended) closeUp.path = path;
  };
  poll();
  const timer = setInterval(() => !document.hidden && poll(), PATH_MS);
  return () => {
    ended = true;
    clearInterval(timer);
    closeUp.path = null;
  };
}

/** Draw the scan: what the beams reached, and the room they saw. */
export function drawScan(paper, view, scan, pose) {
  const { ranges_m: ranges, bearing_first_rad: first, bearing_step_rad: step } = scan;
  const car = scan.x_m === null ? pose : scan;
  const [c, s] = [Math.cos(car.yaw_rad), Math.sin(car.yaw_rad)];
  const x0 = car.x_m + c * scan.scanner_x_m - s * scan.scanner_y_m;
  const y0 = car.y_m + s * scan.scanner_x_m + c * scan.scanner_y_m;
  const hits = [];
  paper.beginPath();
  paper.moveTo(view.x(x0), view.y(y0));
  ranges.forEach((range, i) => {
    const bearing = car.yaw_rad + first + i * step;
    const reach = range ?? 0;
    const x = view.x(x0 + reach * Math.cos(bearing));
    const y = view.y(y0 + reach * Math.sin(bearing));
    paper.lineTo(x, y);
    if (range !== null) hits.push([x, y]);
  });
  paper.closePath();
  paper.fillStyle = "rgba(255, 210, 60, 0.10)";
  paper.fill();
  paper.fillStyle = "#ffd23c";
  paper.strokeStyle = "rgba(8, 12, 18, 0.8)";
  paper.lineWidth = 1;
  paper.beginPath();
  for (const [x, y] of hits) paper.rect(x - 1.75, y - 1.75, 3.5, 3.5);
  paper.stroke();
  paper.fill();
}

/** Draw the way ahead from where the car is; a ring where its trip ends. */
export function drawPath(paper, view, path, pose) {
  const points = path.points_m;
  if (points.length < 2) return;
  const begin = nearest(points, pose);
  paper.beginPath();
  paper.moveTo(view.x(pose.x_m), view.y(pose.y_m));
  for (const [x, y] of points.slice(begin + 1)) paper.lineTo(view.x(x), view.y(y));
  paper.lineJoin = paper.lineCap = "round";
  paper.lineWidth = 7;
  paper.strokeStyle = "rgba(8, 12, 18, 0.55)";
  paper.stroke();
  paper.lineWidth = 3.5;
  paper.strokeStyle = "#5ad1ff";
  paper.stroke();
  if (!path.is_whole) return;
  const [x, y] = points.at(-1);
  paper.beginPath();
  paper.arc(view.x(x), view.y(y), 7, 0, 2 * Math.PI);
  paper.fillStyle = "#10151b";
  paper.fill();
  paper.stroke();
}

/** Number of the point that the car is at, among the first two metres. */
function nearest(points, { x_m, y_m }) {
  let best = 0;
  let least = Infinity;
  points.slice(0, 40).forEach(([x, y], i) => {
    const far = Math.hypot(x - x_m, y - y_m);
    if (far < least) [best, least] = [i, far];
  });
  return best;
}
