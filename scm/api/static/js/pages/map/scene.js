/** One frame of the map, from below to above: roads, heat, path, scan, trails, costmap, boxes, maps, places, plans, cars, tracks, names, signals. */
import { drawBoxes } from "scm/shared/box_shape.js";
import { drawCar, drawHalo, drawLabel, footprint } from "scm/shared/car_shape.js";
import { coveredBy, drawLight } from "scm/shared/light_shape.js";
import { Glide } from "scm/shared/motion.js";
import { selected } from "scm/shared/selection.js";
import { boxes, city, signals, signalsAt } from "scm/shell/store.js";
import { colours } from "scm/shell/theme.js";
import { drawParticles, drawPlans } from "scm/pages/map/autonomy.js";
import { closeUp, drawPath, drawScan } from "scm/pages/map/close_up.js";
import { drawCostmap } from "scm/pages/map/costmap.js";
import { carAt, fleet } from "scm/pages/map/fleet.js";
import { Ground } from "scm/pages/map/ground.js";
import { Heat } from "scm/pages/map/heat.js";
import { followed, layers } from "scm/pages/map/layers.js";
import { drawAim } from "scm/pages/map/park_at.js";
import { drawPlaces } from "scm/pages/map/places.js";
import { RoadNames } from "scm/pages/map/road_names.js";
import { drawRoomMaps } from "scm/pages/map/room_maps.js";
import { drawOffer } from "scm/pages/map/send_to.js";
import { timeToChange } from "scm/pages/map/signal_times.js";
import { drawSprites } from "scm/pages/map/sprites.js";
import { drawTracks } from "scm/pages/map/tracks.js";
import { Trails } from "scm/pages/map/trails.js";

const FRAME_MS = 30; // smooth enough for a floor of cars
const MOST_DETAILED = 40; // cars with wheels and lamps; more of them are drawn as sprites
const DETAIL_PX = 30;
const MOST_NAMES = 60; // more would hide the cars
const EDGE_PX = 40;
const PICK_PX = 22;
const RING_PX = 14;
const SCAN_SHOWN_MS = 1000;

/** How many frames were drawn, what the last one held and how long it took: for measurements. */
export const drawn = { frames: 0, cars: 0, road_names: 0, took_ms: 0 };

export class Scene {
  constructor(canvas, ground, view) {
    this.canvas = canvas;
    this.paper = canvas.getContext("2d", { alpha: false });
    this.view = view;
    this.ground = new Ground(ground);
    this.glide = new Glide();
    this.trails = new Trails();
    this.heat = new Heat(ground.box);
    this.roadNames = new RoadNames();
    this.due = -Infinity;
    this.size = [canvas.clientWidth, canvas.clientHeight];
    this.backdrop = null; // its colour, and of which theme
  }

  /** Draw at most 33 times a second, and never for more than half of the time; returns what ends it. */
  run() {
    let request = 0;
    const frame = (time) => {
      request = requestAnimationFrame(frame);
      if (time < this.due) return;
      const began = performance.now();
      this.draw(began);
      drawn.took_ms = performance.now() - began;
      drawn.frames += 1;
      this.due = time + Math.max(FRAME_MS - 2, 1.6 * drawn.took_ms);
    };
    request = requestAnimationFrame(frame);
    // Measuring the canvas in each frame would force a layout of the whole page.
    const { canvas } = this;
    const sizes = new ResizeObserver(() => (this.size = [canvas.clientWidth, canvas.clientHeight]));
    sizes.observe(canvas);
    return () => {
      cancelAnimationFrame(request);
      sizes.disconnect();
    };
  }

  draw(now) {
    const { view, paper, glide } = this;
    const on = layers.peek();
    this.#prepare();
    glide.step(fleet, now);
    this.#follow();
    this.ground.draw(paper, view, this.ratio, colours.peek() === 0, now);
    if (on.heat) {
      this.heat.note(fleet);
      this.heat.draw(paper, view, now);
    }
    drawOffer(paper, view);
    this.#drawChosenBelow(on, now);
    if (on.trails) {
      this.trails.note(fleet); // above the planned path, which on a circuit lies on all of them
      this.trails.draw(paper, view, this.ratio, now, fleet);
    }
    drawCostmap(paper, view);
    drawBoxes(paper, view, boxes.peek(), city.peek()?.boxes ?? []);
    drawRoomMaps(paper, view);
    drawPlaces(paper, view);
    drawPlans(paper, view);
    this.#drawCars(on);
    drawParticles(paper, view);
    drawAim(paper, view);
    if (on.tracks) drawTracks(paper, view);
    drawn.road_names = on.roads ? this.roadNames.draw(paper, view, now) : 0;
    // Signals last: no car's name may hide a colour.
    this.#drawSignals(on, now);
  }

  /** The car under a pixel; null: none is near. */
  pick(x, y) {
    let best = null;
    let nearest = Math.max(PICK_PX, 0.12 * this.view.scale);
    for (let row = 0; row < fleet.count; row++) {
      const { middle } = footprint(fleet.vehicles[row].car);
      const cx = this.view.x(this.glide.x[row] + middle * Math.cos(this.glide.yaw[row]));
      const cy = this.view.y(this.glide.y[row] + middle * Math.sin(this.glide.yaw[row]));
      const far = Math.hypot(cx - x, cy - y);
      if (far < nearest) [best, nearest] = [fleet.vehicles[row].vehicle, far];
    }
    return best;
  }

  #prepare() {
    const { canvas, paper, view } = this;
    const [width, height] = this.size;
    this.ratio = window.devicePixelRatio || 1;
    const [wide, high] = [Math.round(width * this.ratio), Math.round(height * this.ratio)];
    if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
    view.resize(width, height);
    paper.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    if (this.backdrop?.theme !== colours.peek()) {
      this.backdrop = { theme: colours.peek(), colour: getComputedStyle(canvas).backgroundColor };
    }
    paper.fillStyle = this.backdrop.colour;
    paper.fillRect(0, 0, width, height);
  }

  #follow() {
    const row = fleet.rows.get(followed.peek());
    if (row === undefined || row >= fleet.count) return;
    this.view.centre(this.glide.x[row], this.glide.y[row]);
  }

  /** Where a car of the fleet is drawn now, as an object. */
  #carAt(row) {
    const { glide } = this;
    return { ...carAt(row), x_m: glide.x[row], y_m: glide.y[row], yaw_rad: glide.yaw[row] };
  }

  #drawChosenBelow(on, now) {
    const row = fleet.rows.get(selected.peek());
    if (row === undefined || row >= fleet.count) return;
    const car = this.#carAt(row);
    const { scan, scanAt, path } = closeUp;
    const seen = now - scanAt < SCAN_SHOWN_MS;
    if (on.lidar && seen && scan?.vehicle === car.vehicle) drawScan(this.paper, this.view, scan, car);
    if (on.path && path?.vehicle === car.vehicle) drawPath(this.paper, this.view, path, car);
  }

  #drawCars(on) {
    const { paper, view, glide } = this;
    const rows = this.#rowsSeen();
    const chosen = fleet.rows.get(selected.peek());
    drawn.cars = rows.length;
    const named = on.names && rows.length <= MOST_NAMES;
    const lamps = (city.peek()?.lights ?? []).map((light) => coveredBy(view, light, on.times));
    if (rows.length <= MOST_DETAILED && 0.3 * view.scale >= DETAIL_PX) {
      const cars = rows.map((row) => this.#carAt(row));
      for (const car of cars) drawCar(paper, view, car, car.vehicle === selected.peek(), named, lamps);
      return;
    }
    drawSprites(paper, view, this.ratio, fleet, glide, rows);
    for (const row of rows) {
      if (row !== chosen && !named) continue;
      const car = this.#carAt(row);
      if (row === chosen) this.#drawRing(car);
      drawLabel(paper, view, car, row === chosen, lamps);
    }
  }

  /** A chosen car among many small ones. */
  #drawRing(car) {
    const { paper, view } = this;
    if (0.3 * view.scale < DETAIL_PX) {
      const { middle } = footprint(car.car);
      const [x, y] = [car.x_m + middle * Math.cos(car.yaw_rad), car.y_m + middle * Math.sin(car.yaw_rad)];
      paper.beginPath();
      paper.arc(view.x(x), view.y(y), RING_PX, 0, 2 * Math.PI);
      paper.lineWidth = 2.5;
      paper.strokeStyle = "#ffffff";
      paper.stroke();
      return;
    }
    paper.save();
    paper.translate(view.x(car.x_m), view.y(car.y_m));
    paper.rotate(-car.yaw_rad);
    paper.scale(view.scale, -view.scale);
    drawHalo(paper, footprint(car.car));
    paper.restore();
  }

  #rowsSeen() {
    const { view, glide } = this;
    const rows = [];
    const reach = EDGE_PX + 0.45 * view.scale;
    for (let row = 0; row < fleet.count; row++) {
      const [x, y] = [view.x(glide.x[row]), view.y(glide.y[row])];
      if (x > -reach && y > -reach && x < view.width + reach && y < view.height + reach) rows.push(row);
    }
    return rows;
  }

  #drawSignals(on, now) {
    const groups = new Map();
    const passed_s = (now - signalsAt.peek()) / 1000;
    if (passed_s < 1.5) {
      for (const junction of signals.peek()) {
        for (const group of junction.groups) groups.set(`${junction.junction}/${group.group}`, group);
      }
    }
    for (const light of city.peek()?.lights ?? []) {
      const group = groups.get(`${light.junction}/${light.group}`);
      const time = on.times ? timeToChange(group, passed_s) : "";
      drawLight(this.paper, this.view, light, group?.colour, time);
    }
  }
}
