/** Car files: those that this city knows by name, and a new one from a few figures. */
import { signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { fixed } from "scm/shared/format.js";
import { placed } from "scm/shared/base.js";
import { NewCar } from "scm/pages/cars/new_car.js";

/** `{cars, folder}` as the city has them; null: not read yet, or `{problem}`. */
const files = signal(null);

async function read() {
  const reply = await fetch(placed("/api/v1/cars")).catch(() => null);
  const body = await reply?.json().catch(() => null);
  files.value = reply?.ok ? body : { problem: body?.detail ?? "The city cannot be reached.", cars: [], folder: "" };
}

export function Page() {
  useEffect(() => void read(), []);
  const { cars = [], folder = "", problem = "" } = files.value ?? {};
  return html`
    <${NewCar} folder=${folder} names=${cars.map((car) => car.car)} onWritten=${read} />
    <section class="panel files" aria-label="Car files">
      <div class="panel-head">
        <h2>Car files <small>${cars.length || ""}</small></h2>
        <a href="/vehicles">All vehicles</a>
      </div>
      ${problem && html`<p class="form-error" role="alert">${problem}</p>`}
      <div class="scroll" tabindex="0" role="region" aria-label="Table of car files">
        <table>
          <thead>
            <tr>
              <th>Name</th><th class="wide">Scale</th><th class="number wide">Mass</th><th class="number wide">Wheelbase</th>
              <th class="number wide" title="Of the tightest circle of the middle of its rear axle">Turns on</th>
              <th>Lanes of this city</th><th>File</th>
            </tr>
          </thead>
          <tbody>${cars.map((car) => html`<${Row} key=${car.car} car=${car} />`)}</tbody>
        </table>
      </div>
    </section>
  `;
}

function Row({ car }) {
  if (car.problem) {
    return html`
      <tr data-file=${car.car}>
        <td>${car.car}</td>
        <td colspan="5" class="bad wraps">${car.problem}</td>
        <td><a href="/api/v1/cars/${car.car}.toml" download>TOML</a></td>
      </tr>
    `;
  }
  return html`
    <tr data-file=${car.car}>
      <td>${car.car}${car.shipped ? "" : html` <small>own</small>`}</td>
      <td class="wide">${car.scale}</td>
      <td class="number wide">${fixed(car.mass_kg, 2)} <small>kg</small></td>
      <td class="number wide">${fixed(100 * car.wheelbase_m, 1)} <small>cm</small></td>
      <td class="number wide">${fixed(car.turning_radius_m, 2)} <small>m</small></td>
      <td class="wraps ${car.misfit ? "warn" : ""}">${car.misfit || "follows all"}</td>
      <td><a href="/api/v1/cars/${car.car}.toml" download>TOML</a></td>
    </tr>
  `;
}
