/** Send the chosen car to a lane: by a click on it, or by its name. */
import { signal } from "@preact/signals";
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";
import { selected } from "scm/shared/selection.js";
import { change } from "scm/shell/api.js";
import { city } from "scm/shell/store.js";
import { along, laneAt, lengthOf } from "scm/pages/map/lane_shape.js";

const REACH_PX = 12;
const STEP_M = 0.05;
const COLOUR = "rgba(255, 209, 102, 0.75)";

/** What a click on a lane offers: `{vehicle, lane, points}`; null: nothing. */
const offered = signal(null);
/** Name of the car that somebody wants to send by a lane's name; null: none. */
const openFor = signal(null);

/** Offer to send the chosen car to the lane under a pixel; returns whether there is one. */
export function offer(view, x, y) {
  offered.value = null;
  const lane = selected.value && laneAt(city.value?.lanes ?? [], ...view.place(x, y), REACH_PX / view.scale);
  if (!lane) return false;
  const length = lane.segments.reduce((sum, segment) => sum + lengthOf(segment), 0);
  const steps = Math.max(1, Math.ceil(length / STEP_M));
  const points = Array.from({ length: steps + 1 }, (_, k) => along(lane, (k * length) / steps));
  offered.value = { vehicle: selected.value, lane: lane.name, points };
  return true;
}

export const withdraw = () => (offered.value = null);

/** The offer as it stands: one of another car is none. */
const standing = (offer) => (offer?.vehicle === selected.value ? offer : null);

/** Mark the lane that is offered. */
export function drawOffer(paper, view) {
  const offer = offered.peek();
  if (!offer || offer.vehicle !== selected.peek()) return;
  paper.beginPath();
  for (const { x, y } of offer.points) paper.lineTo(view.x(x), view.y(y));
  paper.lineWidth = 6;
  paper.lineCap = "round";
  paper.strokeStyle = COLOUR;
  paper.stroke();
}

/** The offer as a button on the map. */
export function SendChip() {
  const offer = standing(offered.value);
  if (!offer) return null;
  const { vehicle, lane } = offer;
  return html`<button class="chip send" onClick=${() => send(vehicle, lane, "circulate")}>Send ${vehicle} to ${lane}</button>`;
}

/** The same by a lane's name. */
export function SendTo({ name }) {
  if (!city.value?.lanes.length) return null;
  return html`
    <button class="small" onClick=${() => (openFor.value = name)}>Send to…</button>
    ${openFor.value === name && html`<${Question} name=${name} />`}
  `;
}

function Question({ name }) {
  const close = () => (openFor.value = null);
  const submit = (event) => {
    event.preventDefault();
    const { lane, then } = event.target.elements;
    close();
    send(name, lane.value.trim(), then.value);
  };
  return html`
    <${Dialog} title="Send ${name} to…" onClose=${close}>
      <form class="add-car" onSubmit=${submit}>
        <label>
          Lane
          <input name="lane" list="lanes" defaultValue=${standing(offered.value)?.lane ?? ""} required data-first />
          <datalist id="lanes">${city.value.lanes.map(({ name }) => html`<option key=${name} value=${name}></option>`)}</datalist>
        </label>
        <label>
          At its end
          <select name="then">
            <option value="circulate">drive on</option>
            <option value="stop">stand there</option>
          </select>
        </label>
        <div class="actions">
          <button type="button" onClick=${close}>Cancel</button>
          <button class="primary">Send it</button>
        </div>
      </form>
    <//>
  `;
}

async function send(vehicle, lane, then) {
  const notice = ({ length_m }) => `${vehicle} drives to ${lane}: ${length_m.toFixed(1)} m to its end.`;
  const reply = await change("POST", `/vehicles/${vehicle}/route`, { via: [lane], then }, notice);
  if (reply) withdraw();
}
