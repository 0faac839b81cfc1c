/** The map: roads drawn once by the server, and over them everything that moves or changes. */
import { effect } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { drawBoxes } from "scm/shared/box_shape.js";
import { drawCar, footprint } from "scm/shared/car_shape.js";
import { drawLight } from "scm/shared/light_shape.js";
import { carsNow } from "scm/shared/motion.js";
import { selected } from "scm/shared/selection.js";
import { boxes, city, link, live, signals } from "scm/shell/store.js";

const FRAME_MS = 30;
const MOST_NAMES = 60; // more would hide the cars
const ROADS = "/api/v1/map.svg";

export function MapPanel() {
  const canvas = useRef(null);
  const [box, setBox] = useState(null);
  useEffect(() => void readBox().then(setBox), []);
  useEffect(() => (box ? animate(canvas.current, box) : undefined), [box]);
  const shape = box ? { "--shape": `${box.width} / ${box.height}` } : {};
  return html`
    <section class="panel map" aria-label="Map">
      <div class="sheet" style=${shape} data-link=${link.value}>
        ${box && html`<img class="roads" src=${ROADS} alt="" draggable="false" />`}
        <canvas
          ref=${canvas}
          role="img"
          aria-label="Map of the city with its cars and signals; the tables tell the same in words"
          onClick=${(event) => box && pick(event, box)}
        ></canvas>
      </div>
      <ul class="legend" aria-label="Legend">
        <li><i data-kind="hosted"></i>hosted</li>
        <li><i data-kind="remote"></i>remote</li>
        <li><i data-kind="real"></i>real</li>
        <li><i data-kind="lost"></i>lost</li>
      </ul>
    </section>
  `;
}

/** The picture's frame: map metres, x right; its y counts down, so the map's y is -y. */
async function readBox() {
  const response = await fetch(ROADS);
  const drawing = new DOMParser().parseFromString(await response.text(), "image/svg+xml");
  const [left, top, width, height] = drawing.documentElement
    .getAttribute("viewBox")
    .split(/[\s,]+/)
    .map(Number);
  return { left, top, width, height };
}

/** Metres to pixels of an element, the way the picture below is fitted into it. */
function viewOf(box, width, height) {
  const scale = Math.min(width / box.width, height / box.height);
  const left = (width - scale * box.width) / 2 - scale * box.left;
  const top = (height - scale * box.height) / 2 - scale * box.top;
  return {
    scale,
    x: (x_m) => left + scale * x_m,
    y: (y_m) => top - scale * y_m,
  };
}

function pick(event, box) {
  const { width, height, left, top } = event.currentTarget.getBoundingClientRect();
  const view = viewOf(box, width, height);
  const x = event.clientX - left;
  const y = event.clientY - top;
  let best = null;
  let nearest = 0.2 * view.scale;
  for (const car of live.vehicles) {
    const { middle } = footprint(car.car);
    const far = Math.hypot(
      view.x(car.x_m + middle * Math.cos(car.yaw_rad)) - x,
      view.y(car.y_m + middle * Math.sin(car.yaw_rad)) - y,
    );
    if (far < nearest) [best, nearest] = [car.vehicle, far];
  }
  selected.value = best;
}

/** Draw at most 30 times a second, which is smooth for a table city; returns what ends it. */
function animate(canvas, box) {
  const paper = canvas.getContext("2d");
  const groups = new Map();
  const forget = effect(() => {
    groups.clear();
    for (const junction of signals.value) {
      for (const group of junction.groups) {
        groups.set(`${junction.junction}/${group.group}`, group.colour);
      }
    }
  });
  let request = 0;
  let drawn = -Infinity;
  const frame = (time) => {
    request = requestAnimationFrame(frame);
    if (time - drawn < FRAME_MS) return;
    drawn = time;
    const view = prepare(canvas, paper, box);
    const colours = link.value === "live" ? groups : new Map();
    drawBoxes(paper, view, boxes.value, city.value?.boxes ?? []);
    const cars = carsNow();
    const named = cars.length <= MOST_NAMES;
    for (const car of cars) drawCar(paper, view, car, car.vehicle === selected.value, named);
    // Lights last: no car's name may hide a colour.
    for (const light of city.value?.lights ?? []) {
      drawLight(paper, view, light, colours.get(`${light.junction}/${light.group}`));
    }
  };
  request = requestAnimationFrame(frame);
  return () => {
    cancelAnimationFrame(request);
    forget();
  };
}

function prepare(canvas, paper, box) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const ratio = window.devicePixelRatio || 1;
  const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
  paper.setTransform(ratio, 0, 0, ratio, 0, 0);
  paper.clearRect(0, 0, width, height);
  return viewOf(box, width, height);
}
