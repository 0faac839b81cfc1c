/** Maps that cars make of rooms: on the city's map where their cars are, and each in a panel in its own frame. */
import { computed, effect, signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { autonomyOf, stateInWords } from "scm/shared/autonomy.js";
import { drawCar, footprint } from "scm/shared/car_shape.js";
import { fixed } from "scm/shared/format.js";
import { html } from "scm/shared/html.js";
import { colours } from "scm/shell/theme.js";
import { topic } from "scm/shell/store.js";
import { drawGoal, drawLine } from "scm/pages/map/autonomy.js";
import { carNamed } from "scm/pages/map/fleet.js";
import { drawGrid, painted, unpacked } from "scm/pages/map/grid_picture.js";
import { layers } from "scm/pages/map/layers.js";

const FREE = 0;
const OCCUPIED = 100;
const NONE = [0, 0, 0, 0];
const ON_CITY = { [FREE]: [96, 196, 255, 70], [OCCUPIED]: [208, 255, 64, 255] };
/** Of the panel: dark, light. */
const ON_PANEL = [
  { [FREE]: [38, 52, 68, 255], [OCCUPIED]: [232, 236, 241, 255] },
  { [FREE]: [255, 255, 255, 255], [OCCUPIED]: [23, 32, 43, 255] },
];
const DEGREES = 180 / Math.PI;
const RIM_PX = 6;
const MOST_PX_PER_M = 160;
const MAPS = ["map", "recover"];
const OLD_NS = 3e9; // a status so much later than the newest map is of another agent

/** Car to `{row, cells, onCity}`, as new objects. */
const maps = signal(new Map());

/** Whether an agent maps with a car, by its row of the topic `autonomy`: it sends a map, or is about to. */
export function isMapping({ vehicle, t_ns, state, goal_x_m }) {
  const map = maps.value.get(vehicle);
  return goal_x_m === null && (MAPS.includes(state) || (map !== undefined && t_ns - map.row.t_ns < OLD_NS));
}

/** Unpack maps as they come; returns the function that ends it. */
export function followRoomMaps() {
  return effect(() => {
    const rows = topic("room_maps").value ?? [];
    let ended = false;
    const unpack = async (row) => {
      const known = maps.peek().get(row.vehicle);
      if (known?.row.t_ns === row.t_ns) return [row.vehicle, { ...known, row }];
      const cells = await unpacked(row.cells);
      return [row.vehicle, { row, cells, onCity: painted(cells, row, (value) => ON_CITY[value] ?? NONE) }];
    };
    Promise.all(rows.map(unpack)).then((found) => !ended && (maps.value = new Map(found)), () => {});
    return () => (ended = true);
  });
}

/** Below the cars: each map where its car is in the city, and where the car goes to see more. */
export function drawRoomMaps(paper, view) {
  if (!layers.peek().rooms) return;
  for (const { row, onCity } of maps.peek().values()) {
    if (row.origin_x_m === null) continue;
    const origin = { x: row.origin_x_m, y: row.origin_y_m, yaw: row.origin_yaw_rad };
    paper.imageSmoothingEnabled = false;
    drawGrid(paper, view, onCity, row, origin);
    paper.imageSmoothingEnabled = true;
    drawWay(paper, view, row, origin);
  }
}

function drawWay(paper, view, { vehicle, path }, origin) {
  if (!path.length) return;
  const poses = path.map((pose) => seenFrom(origin, pose));
  drawLine(paper, view, poses, 2);
  const [x, y, yaw] = poses.at(-1);
  drawGoal(paper, view, { x, y, yaw }, footprint(carNamed(vehicle)?.car ?? "nigel"));
}

function seenFrom({ x, y, yaw }, [px, py, turn]) {
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  return [x + c * px - s * py, y + s * px + c * py, yaw + turn];
}

/** What a car that maps does, and its map in its own frame: x is where it looked first. */
export function Mapping({ name }) {
  const row = autonomyOf(name);
  const map = maps.value.get(name);
  if (row ? !isMapping(row) : !map) return null;
  return html`
    <div class="parking mapping">
      <p role="status" class="state" data-state=${row?.state ?? "idle"}>${row ? stateInWords(row) : "Its agent has ended"}</p>
      ${map && html`<${RoomMap} map=${map} />`}
    </div>
  `;
}

function RoomMap({ map }) {
  const canvas = useRef(null);
  const theme = colours.value;
  useEffect(() => draw(canvas.current, map, theme), [map, theme]);
  const { row } = map;
  const free_m2 = freeOf(map) * row.cell_m ** 2;
  const { wide, high } = seenPart(map);
  const size = `${fixed(wide, 1)} × ${fixed(high, 1)} m`;
  const pose = `${fixed(row.car_x_m, 2)}, ${fixed(row.car_y_m, 2)} m, ${fixed(DEGREES * row.car_yaw_rad, 0, "°")}`;
  return html`
    <canvas class="room-map" ref=${canvas} role="img" aria-label="The map that ${row.vehicle} makes, ${size}"></canvas>
    <dl class="moves">
      <div><dt>Free floor</dt><dd>${fixed(free_m2, 2, " m²")} in ${size}</dd></div>
      <div title="From where the car stood at first, x ahead"><dt>Pose on it</dt><dd>${pose}</dd></div>
    </dl>
  `;
}

/** The part of a map in which something is known: its middle and its size [m]. */
function seenPart({ row, cells }) {
  let [left, right, low, high] = [row.columns, -1, row.rows, -1];
  for (let i = 0; i < cells.length; i++) {
    if (cells[i] !== FREE && cells[i] !== OCCUPIED) continue;
    const [line, column] = [Math.floor(i / row.columns), i % row.columns];
    left = Math.min(left, column);
    right = Math.max(right, column);
    low = Math.min(low, line);
    high = Math.max(high, line);
  }
  const [wide, tall] = [Math.max(1, right + 1 - left) * row.cell_m, Math.max(1, high + 1 - low) * row.cell_m];
  return { x: row.x_m + left * row.cell_m + wide / 2, y: row.y_m + low * row.cell_m + tall / 2, wide, high: tall };
}

const freeOf = ({ cells }) => cells.reduce((count, value) => count + (value === FREE), 0);

function draw(canvas, map, theme) {
  const { row, cells } = map;
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  const paper = canvas.getContext("2d");
  paper.setTransform(ratio, 0, 0, ratio, 0, 0);
  const { x: cx, y: cy, wide, high } = seenPart(map);
  const scale = Math.min(MOST_PX_PER_M, (width - 2 * RIM_PX) / wide, (height - 2 * RIM_PX) / high);
  const view = { scale, x: (x) => width / 2 + scale * (x - cx), y: (y) => height / 2 - scale * (y - cy) };
  drawGrid(paper, view, painted(cells, row, (value) => ON_PANEL[theme === 0 ? 0 : 1][value] ?? NONE), row);
  drawWay(paper, view, row, { x: 0, y: 0, yaw: 0 });
  const car = carNamed(row.vehicle) ?? { kind: "hosted", car: "nigel", lights: [], steering_rad: 0, alive: true };
  const at = { x_m: row.car_x_m, y_m: row.car_y_m, yaw_rad: row.car_yaw_rad };
  drawCar(paper, view, { ...car, vehicle: row.vehicle, ...at }, false, false);
}

const isShown = computed(() => layers.value.rooms && maps.value.size > 0);

/** What the signs mean, while there are any. */
export function RoomMapKey() {
  if (!isShown.value) return null;
  const signs = { goal: "looks round next", path: "path", occupied: "obstacle", free: "free floor" };
  return html`
    <ul class="legend plan-key" aria-label="Maps that cars make">
      ${Object.entries(signs).map(([sign, words]) => html`<li key=${sign}><i data-sign=${sign}></i>${words}</li>`)}
    </ul>
  `;
}
