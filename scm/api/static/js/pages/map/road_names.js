/**
 * The names of junctions, lanes and spawn places, in letters of one size however near one looks.
 *
 * A lane's name lies along it, where it covers no other; a name without room waits until one zooms in.
 */
import { city } from "scm/shell/store.js";
import { along, lengthOf, moved, spawnPose } from "scm/pages/map/lane_shape.js";

const SHARES = [0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.15, 0.85]; // of a lane: where its name may stand
const LONGER = 0.85; // the least length of a lane, of its name's
const SPAWN_PX_PER_M = 60; // nearer than this, spawn places are shown
const SPAWN_M = 0.08; // the middle of a car, ahead of the rear axle that is placed
const SPAWN_PX = 4;
const HEAD_PX = 14; // a signal's head, and as far again below it the time of its change
const CELL_PX = 9;
const ROWS = 2 ** 24; // of cells: more than any map has at any scale
const REST_MS = 140; // while one zooms, names stay where they were
const RIM = "rgba(13, 18, 24, 0.92)";
const STYLES = {
  junction: { font: "700 15px system-ui, sans-serif", fill: "#ffd166" },
  lane: { font: "600 13px system-ui, sans-serif", fill: "#fff3c4" },
  spawn: { font: "700 13px system-ui, sans-serif", fill: "#b9deff" },
};

export class RoadNames {
  #map = null;
  #names = []; // all there are: kind, name, places, length of the lane, half the width of the name
  #placed = []; // those that have room, each with the place that it took
  #held = null; // the scale and the part of the floor that they were placed for
  #due = 0;

  /** Draw the names that are seen through `view`; returns how many. */
  draw(paper, view, now) {
    if (this.#map !== city.peek()) {
      this.#map = city.peek();
      this.#names = this.#map ? namesOf(this.#map, paper) : [];
      [this.#placed, this.#held] = [[], null];
    }
    if (this.#map && now >= this.#due && !holds(this.#held, view)) {
      this.#held = { scale: view.scale, ...partOf(view, view.width, view.height) };
      this.#placed = place(this.#names, this.#held, this.#map.lights);
      this.#due = now + REST_MS;
    }
    const seen = this.#placed.filter(({ at, half }) => isIn(partOf(view, half, half), at));
    for (const name of seen) write(paper, view, name);
    return seen.length;
  }
}

/** The part of the floor that is seen, and so many pixels beyond it. */
function partOf(view, wide, high) {
  const [left, up] = view.place(-wide, -high);
  const [right, down] = view.place(view.width + wide, view.height + high);
  return { left, right, down, up };
}

const isIn = ({ left, right, down, up }, { x, y }) => x > left && x < right && y > down && y < up;

/** Whether names were placed at this scale, for all that is seen. */
function holds(held, view) {
  if (held?.scale !== view.scale) return false;
  const { left, right, down, up } = partOf(view, 0, 0);
  return left >= held.left && right <= held.right && down >= held.down && up <= held.up;
}

/** Every name with the poses where it may stand, in the order in which they take their places. */
function namesOf(map, paper) {
  const lanes = new Map(map.lanes.map((lane) => [lane.name, lane]));
  const middle = (name, ways) => {
    const poses = ways.map((way) => along(lanes.get(way.lane), (way.from_m + way.to_m) / 2));
    const mean = (key) => poses.reduce((sum, pose) => sum + pose[key], 0) / poses.length;
    return { kind: "junction", name, places: [{ x: mean("x"), y: mean("y"), yaw: 0 }], length: Infinity };
  };
  const names = [
    ...map.junctions.map(({ name, groups }) => middle(name, groups.flatMap((group) => [group.movement, ...group.more]))),
    ...map.crossings.map(({ name, approaches }) => middle(name, approaches.flatMap(({ ways }) => ways))),
    ...map.lanes.map((lane) => {
      const length = lane.segments.reduce((sum, segment) => sum + lengthOf(segment), 0);
      return { kind: "lane", name: lane.name, places: SHARES.map((share) => along(lane, share * length)), length };
    }),
    ...map.spawns.map((spawn) => {
      const place = { ...moved(spawnPose(map, spawn), SPAWN_M, 0), yaw: 0 };
      return { kind: "spawn", name: spawn.name, places: [place], length: Infinity };
    }),
  ];
  return names.map((name) => ({ ...name, half: halfOf(paper, name) }));
}

/**
 * Give each name the first of its places that is free; who has none is left out.
 *
 * Lanes leave spawn places free where they can: these have one place only.
 */
function place(names, held, lights) {
  const { scale } = held;
  const shown = names.filter(
    ({ kind, places, length, half }) =>
      (kind !== "spawn" || scale >= SPAWN_PX_PER_M) && length * scale >= LONGER * 2 * half && isIn(held, places[0]),
  );
  const heads = lights.map(({ x_m, y_m }) => ({ x: x_m, y: y_m - HEAD_PX / scale, yaw: 0 }));
  const signals = new Set(heads.flatMap((head) => covered(head, scale, 2 * HEAD_PX)));
  const spawns = shown.filter(({ kind }) => kind === "spawn");
  const spots = new Set(spawns.flatMap(({ places, half }) => covered(places[0], scale, half)));
  const occupied = new Set();
  const hindrances = { junction: [[occupied]], lane: [[occupied, signals, spots], [occupied, signals]], spawn: [[occupied, signals]] };
  const placed = [];
  for (const { kind, name, places, half } of shown) {
    const isFree = (at, sets) => !covered(at, scale, half).some((cell) => sets.some((set) => set.has(cell)));
    const at = firstOf(hindrances[kind], (sets) => places.find((place) => isFree(place, sets)));
    if (!at) continue;
    for (const cell of covered(at, scale, half)) occupied.add(cell);
    placed.push({ kind, name, at, half });
  }
  return placed;
}

/** The first answer that there is to one of several questions. */
function firstOf(list, answer) {
  for (const item of list) {
    const found = answer(item);
    if (found) return found;
  }
  return undefined;
}

/** Half the width of a name, and of the sign before it [px]. */
function halfOf(paper, { kind, name }) {
  paper.font = STYLES[kind].font;
  return paper.measureText(name).width / 2 + (kind === "spawn" ? 2 + SPAWN_PX : 2);
}

/** Numbers of the cells of the floor that a name covers. */
function covered({ x, y, yaw }, scale, half) {
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  const steps = Math.ceil((2 * half) / CELL_PX);
  const cells = [];
  for (let k = 0; k <= steps; k++) {
    const ahead = half * ((2 * k) / steps - 1);
    for (const aside of [-CELL_PX, 0, CELL_PX]) {
      const column = Math.floor((x * scale + c * ahead - s * aside) / CELL_PX);
      const row = Math.floor((y * scale + s * ahead + c * aside) / CELL_PX);
      cells.push(column * ROWS + row);
    }
  }
  return cells;
}

function write(paper, view, { kind, name, at, half }) {
  const { font, fill } = STYLES[kind];
  paper.save();
  paper.translate(view.x(at.x), view.y(at.y));
  paper.rotate(Math.PI * Math.round(at.yaw / Math.PI - 1e-3) - at.yaw); // never upside down
  let left = -half + 2;
  if (kind === "spawn") {
    ring(paper, left, fill);
    left += 2 * SPAWN_PX;
  }
  paper.font = font;
  paper.textAlign = "left";
  paper.textBaseline = "middle";
  paper.lineJoin = "round";
  paper.lineWidth = 3.5;
  paper.strokeStyle = RIM;
  paper.strokeText(name, left, 0.5);
  paper.fillStyle = fill;
  paper.fillText(name, left, 0.5);
  paper.restore();
}

/** The sign of a spawn place, before its name. */
function ring(paper, x, colour) {
  paper.beginPath();
  paper.arc(x, 0, SPAWN_PX, 0, 2 * Math.PI);
  paper.fillStyle = RIM;
  paper.fill();
  paper.lineWidth = 1.5;
  paper.strokeStyle = colour;
  paper.stroke();
}
