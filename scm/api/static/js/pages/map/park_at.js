/** Send a car that parks itself to a goal: a place that is clicked, one drawn on the floor, or one by its name. */
import { signal } from "@preact/signals";
import { html } from "scm/shared/html.js";
import { autonomyOf, stateInWords } from "scm/shared/autonomy.js";
import { footprint } from "scm/shared/car_shape.js";
import { Dialog } from "scm/shared/dialog.js";
import { fixed } from "scm/shared/format.js";
import { selected } from "scm/shared/selection.js";
import { change } from "scm/shell/api.js";
import { city } from "scm/shell/store.js";
import { drawGoal } from "scm/pages/map/autonomy.js";
import { carNamed } from "scm/pages/map/fleet.js";
import { layers, show } from "scm/pages/map/layers.js";
import { spawnPose } from "scm/pages/map/lane_shape.js";
import { isMapping } from "scm/pages/map/room_maps.js";

const REACH_PX = 22;
const REACH_M = 0.09; // half of a car's width
const TURN_PX = 12; // a shorter drag gives no heading
const DEGREES = 180 / Math.PI;
const OFFERED = "#ffffff";
const PLACE = "rgba(185, 222, 255, 0.85)";

/** Name of the car whose goal is chosen on the map; null: none. */
const aiming = signal(null);
/** The goal that the map offers: `{vehicle, goal, pose}`, `goal` as the city takes it; null: none. */
const offered = signal(null);
/** Name of the car that somebody wants to park at a place by its name; null: none. */
const openFor = signal(null);

export const isAiming = () => aiming.value !== null && aiming.value === selected.value;

export function stopAiming() {
  aiming.value = offered.value = null;
}

/** Offer the goal of a press at one pixel that was dragged to another. */
export function aim(view, from, to) {
  const vehicle = aiming.peek();
  const car = carNamed(vehicle);
  if (!car) return;
  const { middle } = footprint(car.car);
  const isTurned = Math.hypot(to[0] - from[0], to[1] - from[1]) > TURN_PX;
  const place = isTurned ? null : placeAt(view, from, middle);
  const yaw = isTurned ? Math.atan2(from[1] - to[1], to[0] - from[0]) : car.yaw_rad;
  const [x, y] = view.place(...from);
  const pose = place?.pose ?? { x: x - middle * Math.cos(yaw), y: y - middle * Math.sin(yaw), yaw };
  const goal = place?.name ?? [fixed(pose.x, 3), fixed(pose.y, 3), fixed(DEGREES * pose.yaw, 1)].join();
  offered.value = { vehicle, goal, pose };
}

/** Every place of the map with the pose of a car there. */
const places = () => placesOf(city.peek()).map((place) => ({ name: place.name, pose: spawnPose(city.peek(), place) }));

const placesOf = (map) => [...(map?.bays ?? []), ...(map?.spawns ?? [])];

/** The place whose parked car covers a pixel; undefined: none. */
function placeAt(view, [px, py], middle) {
  const reach = Math.max(REACH_PX, REACH_M * view.scale);
  const far = ({ pose: { x, y, yaw } }) =>
    Math.hypot(view.x(x + middle * Math.cos(yaw)) - px, view.y(y + middle * Math.sin(yaw)) - py);
  return places().filter((one) => far(one) < reach).sort((one, other) => far(one) - far(other))[0];
}

/** Mark the places that can be chosen, and the goal that is offered. */
export function drawAim(paper, view) {
  if (!isAiming()) return;
  const shape = footprint(carNamed(aiming.peek())?.car ?? "nigel");
  paper.font = "700 13px system-ui, sans-serif";
  paper.textAlign = "center";
  paper.textBaseline = "middle";
  for (const { name, pose } of places()) {
    drawGoal(paper, view, pose, shape, PLACE);
    const [x, y] = [pose.x + shape.middle * Math.cos(pose.yaw), pose.y + shape.middle * Math.sin(pose.yaw)];
    paper.lineWidth = 3;
    paper.strokeStyle = "rgba(13, 18, 24, 0.92)";
    paper.strokeText(name, view.x(x), view.y(y));
    paper.fillStyle = "#b9deff";
    paper.fillText(name, view.x(x), view.y(y));
  }
  if (offered.peek()) drawGoal(paper, view, offered.peek().pose, shape, OFFERED);
}

/** The offer as a button on the map; before there is one, how to make it. */
export function ParkChip() {
  if (!isAiming()) return null;
  const offer = offered.value;
  if (!offer) return html`<span class="chip hint" role="status">Click a place, or press on the floor and drag ahead</span>`;
  const { vehicle, goal } = offer;
  return html`
    <button class="chip park" onClick=${() => park(vehicle, goal)}>Park ${vehicle} ${goal.includes(",") ? "there" : `at ${goal}`}</button>
  `;
}

/** What a car that parks itself does, and where to send it. */
export function Parking({ name }) {
  const row = autonomyOf(name);
  if (!row || isMapping(row)) return null;
  const isOn = isAiming();
  const toggle = () => (isOn ? stopAiming() : (aiming.value = name));
  return html`
    <div class="parking" onKeyDown=${({ key }) => key === "Escape" && stopAiming()}>
      <p role="status" class="state" data-state=${row.state}>${stateInWords(row)}</p>
      <dl class="moves">
        <div><dt>Goal</dt><dd>${goalOf(row)}</dd></div>
        <div><dt>Pose</dt><dd>${stdOf(row)}</dd></div>
      </dl>
      <div class="acts">
        <button class="small" aria-pressed=${isOn} title="Choose a goal on the map" onClick=${toggle}>Park here</button>
        <button class="small" onClick=${() => (openFor.value = name)}>Park at…</button>
        <button class="small" aria-pressed=${layers.value.costmap} title="How far each place is from the nearest obstacle" onClick=${() => show("costmap", !layers.value.costmap)}>Costmap</button>
      </div>
    </div>
    ${openFor.value === name && html`<${Question} name=${name} />`}
  `;
}

function goalOf({ goal_x_m: x, goal_y_m: y, goal_yaw_rad: yaw }) {
  return x === null ? "none" : `${fixed(x, 2)}, ${fixed(y, 2)} m, ${fixed(DEGREES * yaw, 0, "°")}`;
}

function stdOf({ position_std_m: far, yaw_std_rad: turn }) {
  return far === null ? "not yet" : `±${fixed(1000 * far, 0, " mm")}, ${fixed(DEGREES * turn, 1, "°")}`;
}

function Question({ name }) {
  const close = () => (openFor.value = null);
  const submit = (event) => {
    event.preventDefault();
    const goal = event.target.elements.goal.value.trim();
    close();
    park(name, goal);
  };
  return html`
    <${Dialog} title="Park ${name} at…" onClose=${close}>
      <form class="add-car" onSubmit=${submit}>
        <label>
          Place of the map, or X,Y,DEG of the rear axle
          <input name="goal" list="places" maxlength="64" defaultValue=${offered.value?.goal ?? ""} required data-first />
          <datalist id="places">${placesOf(city.value).map(({ name }) => html`<option key=${name} value=${name}></option>`)}</datalist>
        </label>
        <div class="actions">
          <button type="button" onClick=${close}>Cancel</button>
          <button class="primary">Park it</button>
        </div>
      </form>
    <//>
  `;
}

async function park(vehicle, goal) {
  const notice = ({ x_m, y_m }) => `${vehicle} parks at ${fixed(x_m, 2)}, ${fixed(y_m, 2, " m")}.`;
  const reply = await change("POST", `/vehicles/${vehicle}/goal`, { goal }, notice);
  if (reply) stopAiming();
}
