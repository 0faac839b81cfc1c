/** Where cars came from: the last places of each, fading; shared out so that any number can be drawn. */
import { paintOf } from "scm/shared/car_shape.js";

const EVERY_S = 0.15;
const MOST_POINTS = 90;
const ALL_POINTS = 14000;
const JUMP_M = 0.8;
const SHADES = [0.25, 0.5, 0.85];

export class Trails {
  constructor() {
    this.cars = new Map();
    this.t_s = -Infinity;
  }

  /** Note where all cars are, if it is time. */
  note(fleet) {
    if (fleet.t_s === null || Math.abs(fleet.t_s - this.t_s) < EVERY_S) return;
    if (fleet.t_s < this.t_s) this.cars.clear(); // the world was started anew
    this.t_s = fleet.t_s;
    const most = Math.max(6, Math.min(MOST_POINTS, Math.floor(ALL_POINTS / Math.max(1, fleet.count))));
    for (const [vehicle, row] of fleet.rows) {
      let places = this.cars.get(vehicle);
      if (!places) this.cars.set(vehicle, (places = []));
      places.push([fleet.x[row], fleet.y[row]]);
      if (places.length > most) places.splice(0, places.length - most);
    }
    for (const vehicle of this.cars.keys()) if (!fleet.rows.has(vehicle)) this.cars.delete(vehicle);
  }

  draw(paper, view, fleet, glide) {
    const lines = new Map();
    for (const [vehicle, places] of this.cars) {
      const row = fleet.rows.get(vehicle);
      if (row === undefined || row >= fleet.count) continue;
      const [colour] = paintOf(fleet.vehicles[row].kind, (fleet.flags[row] & 1) === 1);
      if (!lines.has(colour)) lines.set(colour, SHADES.map(() => new Path2D()));
      trace(lines.get(colour), view, places, [glide.x[row], glide.y[row]]);
    }
    paper.lineWidth = Math.max(1.5, Math.min(5, 0.02 * view.scale));
    paper.lineJoin = "round";
    for (const [colour, paths] of lines) {
      paper.strokeStyle = colour;
      paths.forEach((path, shade) => {
        paper.globalAlpha = SHADES[shade];
        paper.stroke(path);
      });
    }
    paper.globalAlpha = 1;
  }
}

function trace(paths, view, places, here) {
  const count = places.length;
  let before = null;
  for (let i = 0; i <= count; i++) {
    const place = i < count ? places[i] : here;
    if (before && Math.abs(place[0] - before[0]) + Math.abs(place[1] - before[1]) < JUMP_M) {
      const path = paths[Math.min(SHADES.length - 1, Math.floor((SHADES.length * i) / (count + 1)))];
      path.moveTo(view.x(before[0]), view.y(before[1]));
      path.lineTo(view.x(place[0]), view.y(place[1]));
    }
    before = place;
  }
}
