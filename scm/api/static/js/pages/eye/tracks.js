/** Where all cameras together take each car to be, with what is wrong with it. */
import { html } from "scm/shared/html.js";
import { fixed, span } from "scm/shared/format.js";
import { useFetched } from "scm/shared/fetched.js";

const POLL_MS = 500;
const DEG = 180 / Math.PI;

export function Tracks() {
  const { body, error } = useFetched("/eye/tracks", POLL_MS);
  const rows = body?.tracks ?? [];
  return html`
    <section class="panel wide eye-tracks" aria-label="Tracks">
      <div class="panel-head">
        <h2>Tracks</h2>
        <span class="facts">by all cameras together; the map shows them as a layer</span>
      </div>
      ${rows.length
        ? html`<div class="scroll" tabindex="0" role="region" aria-label="Table of tracks"><${Table} rows=${rows} /></div>`
        : html`<p class="empty">${error || "No track."}</p>`}
    </section>
  `;
}

function Table({ rows }) {
  return html`
    <table>
      <thead>
        <tr>
          <th scope="col">Vehicle</th>
          <th scope="col" class="number">Tag</th>
          <th scope="col" class="number" title="x, y on the map; two standard deviations">Place</th>
          <th scope="col" class="number">Yaw</th>
          <th scope="col" class="number">Speed</th>
          <th scope="col" class="number" title="Since a camera last saw it">Seen</th>
          <th scope="col">Cameras</th>
          <th scope="col">Flags</th>
        </tr>
      </thead>
      <tbody>
        ${rows.map((one) => html`
          <tr key=${one.vehicle} data-track=${one.vehicle}>
            <td>${one.vehicle}</td>
            <td class="number">${one.tag_id}</td>
            <td class="number">
              ${`${fixed(one.x_m, 3)}, ${fixed(one.y_m, 3)} m`} <small>${`±${fixed(2000 * Math.max(one.std_x_m, one.std_y_m), 1)} mm`}</small>
            </td>
            <td class="number">${fixed(DEG * one.yaw_rad, 1, "°")} <small>${`±${fixed(2 * DEG * one.std_yaw_rad, 1)}`}</small></td>
            <td class="number">${fixed(one.speed_mps, 2, " m/s")}</td>
            <td class="number ${one.stale ? "warn" : ""}">${span(one.age_s)}</td>
            <td>${one.cameras.join(", ")}</td>
            <td class="warn">${[...(one.stale ? ["stale"] : []), ...one.flags].join(", ")}</td>
          </tr>
        `)}
      </tbody>
    </table>
  `;
}
