/** The chosen car in short: what it is and does, and what can be shown or done with it. */
import { signal } from "@preact/signals";
import { autonomyOf } from "scm/shared/autonomy.js";
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";
import { age, fixed, UNKNOWN } from "scm/shared/format.js";
import { selected } from "scm/shared/selection.js";
import { change } from "scm/shell/api.js";
import { blind } from "scm/pages/map/close_up.js";
import { carNamed, fleetTick } from "scm/pages/map/fleet.js";
import { followed, layers, show } from "scm/pages/map/layers.js";
import { Parking } from "scm/pages/map/park_at.js";
import { isMapping, Mapping } from "scm/pages/map/room_maps.js";
import { SendTo } from "scm/pages/map/send_to.js";

const DEGREES = 180 / Math.PI;

/** Name of the car that somebody may want to take away; null: none. */
const removing = signal(null);

export function ChosenVehicle() {
  fleetTick.value;
  const name = selected.value;
  if (!name) return null;
  const car = carNamed(name);
  const leave = () => (followed.value = selected.value = null);
  return html`
    <section class="panel chosen-car" aria-label="Chosen vehicle ${name}">
      <div class="panel-head">
        <h2>
          ${car && html`<span class="kind" data-kind=${car.alive ? car.kind : "lost"}></span>`}${name}
          ${car && html` <small>${car.kind} ${car.car}, tag ${car.tag_id}</small>`}
        </h2>
        <button class="plain" aria-label="Let go of ${name}" title="Let go (Escape)" onClick=${leave}>✕</button>
      </div>
      ${car ? html`<${Facts} car=${car} /><${Mapping} name=${name} /><${Parking} name=${name} /><${Acts} name=${name} />` : html`<p class="empty">It is not on the map.</p>`}
      ${removing.value && html`<${RemoveDialog} name=${removing.value} />`}
    </section>
  `;
}

function Facts({ car }) {
  return html`
    <dl class="moves">
      <div><dt>Speed</dt><dd>${fixed(car.speed_mps, 2, " m/s")}</dd></div>
      <div><dt>Heading</dt><dd>${fixed(DEGREES * car.yaw_rad, 0, "°")}</dd></div>
      <div><dt>Place</dt><dd>${fixed(car.x_m, 2)}, ${fixed(car.y_m, 2, " m")}</dd></div>
      <div><dt>Mode</dt><dd class="mode" data-mode=${car.alive ? car.mode : "lost"}>${car.alive ? car.mode : "lost"}</dd></div>
      <div><dt>Owner</dt><dd title=${car.owner}>${car.owner}</dd></div>
      <div><dt>Age</dt><dd>${age(car.age_ms)}</dd></div>
      <div><dt>Trip</dt><dd>${tripOf(car)}</dd></div>
      <div><dt>Waits for</dt><dd>${car.waits || UNKNOWN}</dd></div>
    </dl>
  `;
}

function tripOf({ done_m, length_m }) {
  if (Number.isNaN(done_m)) return UNKNOWN;
  return Number.isFinite(length_m) ? `${fixed(done_m, 1)} of ${fixed(length_m, 1)} m` : `${fixed(done_m, 1)} m so far`;
}

function Acts({ name }) {
  const toggle = (layer, title) => html`
    <button class="small" aria-pressed=${layers.value[layer]} onClick=${() => show(layer, !layers.value[layer])}>${title}</button>
  `;
  const lidar = blind.value === name
    ? html`<button class="small" disabled aria-pressed="false" title="${name} has no LIDAR">No LIDAR</button>`
    : toggle("lidar", "LIDAR");
  const follow = () => (followed.value = followed.value === name ? null : name);
  return html`
    <div class="acts">
      <button class="small" aria-pressed=${followed.value === name} onClick=${follow}>Follow</button>
      ${planToggle(autonomyOf(name), toggle)} ${lidar}
      <${SendTo} name=${name} />
      <a href="/vehicles/${name}">Open</a>
      <button class="small" onClick=${() => (removing.value = name)}>Remove</button>
    </div>
  `;
}

function planToggle(row, toggle) {
  if (!row) return toggle("path", "Path");
  return isMapping(row) ? toggle("rooms", "Map") : toggle("autonomy", "Plan");
}

function RemoveDialog({ name }) {
  const close = () => (removing.value = null);
  const remove = async () => {
    close();
    const reply = await change("DELETE", `/vehicles/${name}?reason=dashboard`, undefined, () => `${name} is off the map.`);
    if (reply && selected.value === name) followed.value = selected.value = null;
  };
  return html`
    <${Dialog} title="Remove ${name} from the map?" onClose=${close}>
      <div class="actions">
        <button onClick=${close}>Cancel</button>
        <button class="danger" data-first onClick=${remove}>Remove it</button>
      </div>
    <//>
  `;
}
