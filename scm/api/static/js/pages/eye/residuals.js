/** How far a camera's poses lay from the truth of the last minutes: on the floor, and in numbers. */
import { useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { fixed } from "scm/shared/format.js";
import { useFetched } from "scm/shared/fetched.js";
import { ResidualFloor } from "scm/pages/eye/residual_floor.js";

const WINDOWS = { 30: "30 s", 120: "2 min", 300: "5 min" };
const GOOD_MM = 10;
const PERIOD_MS = 1000;

export function Residuals({ camera }) {
  const [window_s, setWindow] = useState("120");
  const [vehicle, setVehicle] = useState("");
  const path = `/eye/cameras/${camera.camera}/residuals?window_s=${window_s}`;
  const { body, error } = useFetched(path, PERIOD_MS);
  const shown = body?.samples.filter((one) => !vehicle || one.vehicle === vehicle) ?? [];
  const picked = body?.vehicles.some((one) => one.vehicle === vehicle) ? vehicle : "";
  return html`
    <section class="panel eye-floor" aria-label="Residuals on the floor">
      <div class="panel-head">
        <h2>Residuals <small>measured minus true</small></h2>
        <span class="choices" role="group" aria-label="How far back">
          ${Object.entries(WINDOWS).map(
            ([value, title]) => html`
              <button key=${value} class="small" aria-pressed=${window_s === value} onClick=${() => setWindow(value)}>
                ${title}
              </button>
            `,
          )}
        </span>
      </div>
      ${error && html`<p class="warn" role="alert">${error}</p>`}
      <${ResidualFloor} samples=${picked ? shown : (body?.samples ?? [])} />
    </section>
    <section class="panel eye-numbers" aria-label="Residuals in numbers">
      <div class="panel-head">
        <h2>In numbers</h2>
        <span class="facts">${body ? `${body.stats.samples} samples, two a second of each car` : "reads"}</span>
      </div>
      ${body && body.stats.samples > 0
        ? html`<${Numbers} body=${body} picked=${picked} pick=${setVehicle} />`
        : html`<p class="empty">${body ? "No pose with a known truth: real cars have none, and a city that has just begun has none yet." : "Reads the residuals …"}</p>`}
    </section>
  `;
}

function Numbers({ body, picked, pick }) {
  const rows = body.vehicles.toSorted((a, b) => b.stats.p95_mm - a.stats.p95_mm);
  return html`
    <div class="scroll" tabindex="0" role="region" aria-label="Table of residuals">
      <table>
        <thead>
          <tr>
            <th scope="col" rowspan="2">Car</th>
            <th scope="colgroup" colspan="3" class="number">Distance [mm]</th>
            <th scope="colgroup" colspan="2" class="number">Bias [mm]</th>
            <th scope="colgroup" colspan="2" class="number">Yaw [°]</th>
          </tr>
          <tr>
            <th scope="col" class="number">mean</th>
            <th scope="col" class="number">95 %</th>
            <th scope="col" class="number">worst</th>
            <th scope="col" class="number">x</th>
            <th scope="col" class="number">y</th>
            <th scope="col" class="number">bias</th>
            <th scope="col" class="number">std</th>
          </tr>
        </thead>
        <tbody>
          <tr class="whole ${picked ? "" : "chosen"}">
            <td><button class="name" aria-pressed=${!picked} onClick=${() => pick("")}>all cars</button></td>
            <${Cells} of=${body.stats} />
          </tr>
          ${rows.map(
            ({ vehicle, stats }) => html`
              <tr key=${vehicle} class=${picked === vehicle ? "chosen" : ""}>
                <td>
                  <button
                    class="name"
                    aria-pressed=${picked === vehicle}
                    title="Show its arrows alone"
                    onClick=${() => pick(picked === vehicle ? "" : vehicle)}
                  >${vehicle}</button>
                </td>
                <${Cells} of=${stats} />
              </tr>
            `,
          )}
        </tbody>
      </table>
    </div>
    <p class="note">Bias: the mean of measured minus true, along the map's x and y; + yaw: measured further left.</p>
  `;
}

function Cells({ of: stats }) {
  const bad = (value) => (value > GOOD_MM ? "number warn" : "number");
  return html`
    <td class="number">${fixed(stats.mean_mm, 1)}</td>
    <td class=${bad(stats.p95_mm)}>${fixed(stats.p95_mm, 1)}</td>
    <td class=${bad(stats.worst_mm)}>${fixed(stats.worst_mm, 1)}</td>
    <td class="number">${fixed(stats.bias_x_mm, 1)}</td>
    <td class="number">${fixed(stats.bias_y_mm, 1)}</td>
    <td class="number">${fixed(stats.bias_yaw_deg, 2)}</td>
    <td class="number">${fixed(stats.yaw_std_deg, 2)}</td>
  `;
}
