/** All vehicles in one table: who drives them, how they are, and whether to believe them. */
import { signal } from "@preact/signals";
import { modeOf, stuckBy } from "scm/shared/condition.js";
import { html } from "scm/shared/html.js";
import { age, byName, fixed, UNKNOWN } from "scm/shared/format.js";
import { pulse, since_ms, world } from "scm/shell/store.js";
import { batteryState, batteryWord, BatterySign, percent } from "scm/pages/vehicle/battery.js";
import { misbehaviourOf, useMisbehaviour } from "scm/pages/vehicle/misbehaviour.js";
import { isAtHome, ownerOf } from "scm/pages/vehicle/lease.js";

const STALE_MS = 500;
const KINDS = ["all", "hosted", "remote", "real"];

const wanted = signal({ text: "", kind: "all" });

export function FleetTable() {
  useMisbehaviour();
  const all = world.value.vehicles;
  const text = wanted.value.text.toLowerCase();
  const shown = all
    .filter((car) => wanted.value.kind === "all" || car.kind === wanted.value.kind)
    .filter((car) => [car.vehicle, car.owner, car.car, modeOf(car)].some((word) => word.toLowerCase().includes(text)))
    .toSorted((a, b) => byName(a.vehicle, b.vehicle));
  const set = (change) => (wanted.value = { ...wanted.value, ...change });
  return html`
    <section class="panel fleet" aria-label="Vehicles">
      <div class="panel-head">
        <h2>Vehicles <small>${shown.length === all.length ? all.length : `${shown.length} of ${all.length}`}</small></h2>
        <div class="filters">
          <a href="/cars">Car files</a>
          <input
            type="search"
            placeholder="Name, owner, mode"
            aria-label="Filter vehicles"
            value=${wanted.value.text}
            onInput=${(event) => set({ text: event.target.value })}
          />
          <div class="choices" role="group" aria-label="Kind">
            ${KINDS.map(
              (kind) => html`
                <button class="small" aria-pressed=${wanted.value.kind === kind} onClick=${() => set({ kind })}>${kind}</button>
              `,
            )}
          </div>
        </div>
      </div>
      <div class="scroll moves" tabindex="0" role="region" aria-label="Table of vehicles">
        <table>
          <thead>
            <tr>
              <th>Name</th><th>State</th><th>Kind</th><th class="wide">Car</th><th>Driven by</th>
              <th class="number">Speed</th><th class="wide">Trip</th><th class="number wide">Battery</th>
              <th class="number wide" title="Misbehaviour score of its messages">Misbehaviour</th><th class="number wide" title="Age of its newest report">Link</th>
            </tr>
          </thead>
          <tbody>${shown.map((car) => html`<${Row} key=${car.vehicle} car=${car} />`)}</tbody>
        </table>
        ${!shown.length && html`<p class="empty">${all.length ? "No vehicle is like that." : nobody()}</p>`}
      </div>
    </section>
  `;
}

function nobody() {
  return pulse.value.t_ns === null ? "The world is starting." : "No vehicle is in the city. Add one on the map.";
}

function Row({ car }) {
  const mode = modeOf(car);
  const suspicion = misbehaviourOf(car.vehicle);
  const age_ms = car.age_ms + since_ms.value;
  return html`
    <tr data-car=${car.vehicle} data-alive=${car.alive}>
      <td><a class="to" href="/vehicles/${car.vehicle}">${car.vehicle}</a></td>
      <td>
        <span class="mode" data-mode=${mode} title=${stuckBy(car)}>${mode}</span>
        ${batteryWord(car) && html` <span class="charge narrow" data-battery=${batteryState(car)}><${BatterySign} car=${car} />${batteryWord(car)}</span>`}
      </td>
      <td><span class="kind" data-kind=${car.kind}>${car.kind}</span></td>
      <td class="wide">${car.car}</td>
      <td class=${isAtHome(car) ? "" : "warn"}>${ownerOf(car)}</td>
      <td class="number">${fixed(car.speed_mps, 2)} <small>m/s</small></td>
      <td class="wide">${tripOf(car)}</td>
      <td class="number wide charge" data-battery=${batteryState(car)} title=${fixed(car.battery_v, 2, " V")}>
        ${batteryWord(car)} <${BatterySign} car=${car} /> ${percent(car) || fixed(car.battery_v, 1, " V")}
      </td>
      <td class="number wide ${suspicion.suspected ? "bad" : ""}">${suspicion.suspected ? "suspected" : suspicion.score === null ? UNKNOWN : fixed(suspicion.score, 1)}</td>
      <td class="number wide ${age_ms > STALE_MS ? "warn" : ""}">${age(age_ms)}</td>
    </tr>
  `;
}

function tripOf(car) {
  if (!car.trip) return UNKNOWN;
  return car.trip.void.length ? html`${wayOf(car)} <small title=${car.trip.void.join("; ")}>void</small>` : wayOf(car);
}

function wayOf(car) {
  if (car.trip.waiting_for) return `waits for ${car.trip.waiting_for}`;
  if (car.trip.arrived) return "arrived";
  if (car.trip.length_m === null) return "circulates";
  return `${fixed(car.trip.done_m, 1)} of ${fixed(car.trip.length_m, 1)} m`;
}
