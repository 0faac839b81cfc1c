/** The map of a recording with the cars of one moment, unmistakably not the live one. */
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { drawBoxes } from "scm/shared/box_shape.js";
import { drawCar, footprint } from "scm/shared/car_shape.js";
import { readBox } from "scm/shared/drawing.js";
import { drawLight } from "scm/shared/light_shape.js";

const TRAIL_S = 6;
const MOST_NAMES = 60;
const COLOURS = { hosted: "#4c8df0", remote: "#a97bf2", real: "#f0a13c" };

export function ReplayMap({ player, summary, chosen, onChoose }) {
  const canvas = useRef(null);
  const [box, setBox] = useState(null);
  const roads = `/api/v1/recordings/${encodeURIComponent(player.name)}/map.svg`;
  const pick = useRef(null);
  pick.current = chosen;
  useEffect(() => void readBox(roads).then(setBox), [roads]);
  useEffect(() => {
    if (!box) return undefined;
    let request = 0;
    const frame = () => {
      request = requestAnimationFrame(frame);
      // The page may be gone before its cleanup ran.
      if (canvas.current) draw(canvas.current, box, player, summary, pick.current);
    };
    request = requestAnimationFrame(frame);
    return () => cancelAnimationFrame(request);
  }, [box, player, summary]);
  return html`
    <div class="sheet">
      ${box && html`<img class="roads" src=${roads} alt="" draggable="false" />`}
      <canvas
        ref=${canvas}
        role="img"
        aria-label="Map with the cars and signals of this moment of the recording; the table shows the same in words"
        onClick=${(event) => box && onChoose(nearest(event, box, player))}
      ></canvas>
      <p class="stamp" aria-hidden="true">Not live</p>
    </div>
  `;
}

function viewOf(box, width, height) {
  const scale = Math.min(width / box.width, height / box.height);
  const left = (width - scale * box.width) / 2 - scale * box.left;
  const top = (height - scale * box.height) / 2 - scale * box.top;
  return { scale, x: (x_m) => left + scale * x_m, y: (y_m) => top - scale * y_m };
}

function draw(canvas, box, player, summary, chosen) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const ratio = window.devicePixelRatio || 1;
  const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
  const state = player.now();
  canvas.parentElement.dataset.shown = state ? (state.silent ? "silent" : "cars") : "waiting";
  if (!state) return; // the picture before stays until this one is here
  if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
  const paper = canvas.getContext("2d");
  paper.setTransform(ratio, 0, 0, ratio, 0, 0);
  paper.clearRect(0, 0, width, height);
  const view = viewOf(box, width, height);
  drawBoxes(paper, view, state.boxes, summary.boxes);
  drawTrails(paper, view, player, state.cars);
  const named = state.cars.length <= MOST_NAMES;
  for (const car of state.cars) drawCar(paper, view, car, car.vehicle === chosen, named);
  for (const light of summary.lights) {
    drawLight(paper, view, light, state.colours.get(`${light.junction}/${light.group}`));
  }
}

function drawTrails(paper, view, player, cars) {
  const kinds = new Map(cars.map((car) => [car.vehicle, car.kind]));
  paper.lineWidth = 2.5;
  paper.lineJoin = paper.lineCap = "round";
  paper.globalAlpha = 0.55;
  for (const [vehicle, points] of player.trails(TRAIL_S)) {
    if (!kinds.has(vehicle)) continue;
    paper.strokeStyle = COLOURS[kinds.get(vehicle)] ?? COLOURS.hosted;
    paper.beginPath();
    for (const [x, y] of points) paper.lineTo(view.x(x), view.y(y));
    paper.stroke();
  }
  paper.globalAlpha = 1;
}

function nearest(event, box, player) {
  const { width, height, left, top } = event.currentTarget.getBoundingClientRect();
  const view = viewOf(box, width, height);
  let [best, far] = [null, 0.2 * view.scale];
  for (const car of player.now()?.cars ?? []) {
    const { middle } = footprint(car.car);
    const away = Math.hypot(
      view.x(car.x_m + middle * Math.cos(car.yaw_rad)) - (event.clientX - left),
      view.y(car.y_m + middle * Math.sin(car.yaw_rad)) - (event.clientY - top),
    );
    if (away < far) [best, far] = [car.vehicle, away];
  }
  return best;
}
