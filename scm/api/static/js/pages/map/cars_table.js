/** The cars as a table: who, whose, how fast, how fresh, how far, and what holds them. */
import { signal } from "@preact/signals";
import { html } from "scm/shared/html.js";
import { change } from "scm/shell/api.js";
import { Dialog } from "scm/shared/dialog.js";
import { age, byName, fixed, UNKNOWN } from "scm/shared/format.js";
import { selected } from "scm/shared/selection.js";
import { city, world } from "scm/shell/store.js";

const STALE_MS = 500;

/** Name of the car that somebody may want to take away; null: none. */
const removing = signal(null);

export function CarsTable() {
  const cars = world.value.vehicles.toSorted((a, b) => byName(a.vehicle, b.vehicle));
  return html`
    <section class="panel cars" aria-label="Cars">
      <div class="panel-head">
        <h2>Cars <small>${cars.length}</small></h2>
        <button class="small" onClick=${add}>Add a car</button>
      </div>
      <div class="scroll" tabindex="0" role="region" aria-label="Table of cars">
        <table>
          <thead>
            <tr>
              <th>Name</th><th>Kind</th><th class="owner">Owner</th><th>Mode</th>
              <th class="number">Speed</th><th class="number age">Age</th>
              <th>Trip</th><th>Waits for</th><th><span class="hidden">Remove</span></th>
            </tr>
          </thead>
          <tbody>${cars.map((car) => html`<${Car} key=${car.vehicle} car=${car} />`)}</tbody>
        </table>
        ${!cars.length && html`<p class="empty">No car is on the map.</p>`}
      </div>
      ${removing.value && html`<${RemoveDialog} name=${removing.value} />`}
    </section>
  `;
}

/** A car that stood where it was put would block its lane: where there are lanes, it drives. */
async function add() {
  const reply = await change("POST", "/vehicles", {}, ({ vehicle }) => `${vehicle} is on the map.`);
  if (reply && city.value?.lanes.length) await change("POST", `/vehicles/${reply.vehicle}/route`, {});
}

function Car({ car }) {
  const chosen = selected.value === car.vehicle;
  const choose = () => (selected.value = chosen ? null : car.vehicle);
  const mode = car.alive ? car.mode : "lost";
  return html`
    <tr data-car=${car.vehicle} data-alive=${car.alive} class=${chosen ? "chosen" : ""}>
      <td>
        <button class="name" aria-pressed=${chosen} onClick=${choose}>${car.vehicle}</button>
      </td>
      <td><span class="kind" data-kind=${car.kind}>${car.kind}</span></td>
      <td class="owner">${car.owner}</td>
      <td><span class="mode" data-mode=${mode}>${mode}</span></td>
      <td class="number">${fixed(car.speed_mps, 2)} <small>m/s</small></td>
      <td class="number age ${car.age_ms > STALE_MS ? "warn" : ""}">${age(car.age_ms)}</td>
      <td><${Trip} trip=${car.trip} /></td>
      <td>${car.trip?.waiting_for ?? ""}</td>
      <td>
        <button class="plain" title="Take ${car.vehicle} off the map" aria-label="Take ${car.vehicle} off the map" onClick=${() => (removing.value = car.vehicle)}>✕</button>
      </td>
    </tr>
  `;
}

function RemoveDialog({ name }) {
  const close = () => (removing.value = null);
  const remove = () => {
    close();
    change("DELETE", `/vehicles/${name}?reason=dashboard`, undefined, () => `${name} is off the map.`);
  };
  return html`
    <${Dialog} title="Take ${name} off the map?" onClose=${close}>
      <div class="actions">
        <button onClick=${close}>Cancel</button>
        <button class="danger" data-first onClick=${remove}>Take it off</button>
      </div>
    <//>
  `;
}

function Trip({ trip }) {
  if (!trip) return UNKNOWN;
  if (trip.arrived) return html`<span class="arrived">arrived</span>`;
  if (trip.length_m === null) return html`<span class="trip">${fixed(trip.done_m, 1)} m</span>`;
  return html`
    <span class="trip">
      <progress value=${trip.done_m} max=${trip.length_m} aria-label="Trip progress"></progress>
      ${fixed(trip.done_m, 1)} / ${fixed(trip.length_m, 1)} m
    </span>
  `;
}
