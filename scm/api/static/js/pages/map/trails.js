/** Where cars came from: the last places of each, fading; shared out so that any number can be drawn. */
import { paintOf } from "scm/shared/car_shape.js";
import { CachedLayer } from "scm/pages/map/cached_layer.js";

const EVERY_S = 0.15;
const MOST_POINTS = 90;
const ALL_POINTS = 8000;
const LEAST_POINTS = 8;
const JUMP_M = 0.8;
const SHADES = [0.25, 0.5, 0.85];

export class Trails {
  constructor() {
    this.cars = new Map();
    this.t_s = -Infinity;
    this.layer = new CachedLayer();
  }

  /** Note where all cars are, if it is time. */
  note(fleet) {
    if (fleet.t_s === null || Math.abs(fleet.t_s - this.t_s) < EVERY_S) return;
    if (fleet.t_s < this.t_s) this.cars.clear(); // the world was started anew
    this.t_s = fleet.t_s;
    const share = Math.floor(ALL_POINTS / Math.max(1, fleet.count));
    const most = Math.max(LEAST_POINTS, Math.min(MOST_POINTS, share));
    for (const [vehicle, row] of fleet.rows) {
      let places = this.cars.get(vehicle);
      if (!places) this.cars.set(vehicle, (places = []));
      places.push([fleet.x[row], fleet.y[row]]);
      if (places.length > most) places.splice(0, places.length - most);
    }
    for (const vehicle of this.cars.keys()) if (!fleet.rows.has(vehicle)) this.cars.delete(vehicle);
  }

  draw(paper, view, ratio, now, fleet) {
    this.layer.draw(paper, view, ratio, now, (sheet) => this.#paint(sheet, view, fleet));
  }

  #paint(paper, view, fleet) {
    const lines = new Map();
    for (const [vehicle, places] of this.cars) {
      const row = fleet.rows.get(vehicle);
      if (row === undefined || row >= fleet.count) continue;
      const [colour] = paintOf(fleet.vehicles[row].kind, (fleet.flags[row] & 1) === 1);
      if (!lines.has(colour)) lines.set(colour, SHADES.map(() => new Path2D()));
      trace(lines.get(colour), view, places);
    }
    paper.lineWidth = Math.max(1.5, Math.min(5, 0.02 * view.scale));
    for (const [colour, paths] of lines) {
      paper.strokeStyle = colour;
      paths.forEach((path, shade) => {
        paper.globalAlpha = SHADES[shade];
        paper.stroke(path);
      });
    }
  }
}

/** One line a shade, broken where the car was put elsewhere. */
function trace(paths, view, places) {
  let before = null;
  let on = null;
  places.forEach((place, i) => {
    const path = paths[Math.floor((SHADES.length * i) / places.length)];
    const near = before && Math.abs(place[0] - before[0]) + Math.abs(place[1] - before[1]) < JUMP_M;
    if (near && path !== on) path.moveTo(view.x(before[0]), view.y(before[1]));
    if (near) path.lineTo(view.x(place[0]), view.y(place[1]));
    else path.moveTo(view.x(place[0]), view.y(place[1]));
    [before, on] = [place, path];
  });
}
