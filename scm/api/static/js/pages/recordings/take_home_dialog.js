/** Files to take home: the recording itself, its cars as CSV, and what Foxglove draws. */
import { useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";
import { size } from "scm/pages/recordings/words.js";

export function TakeHomeDialog({ recording, cars, onClose }) {
  const [vehicle, setVehicle] = useState("");
  const at = `/api/v1/recordings/${encodeURIComponent(recording.name)}`;
  const csv = `${at}/csv${vehicle && `?vehicle=${encodeURIComponent(vehicle)}`}`;
  return html`
    <${Dialog} title="Download" onClose=${onClose}>
      <dl class="files">
        <div>
          <dt>The recording <small>MCAP, ${size(recording.size_bytes)}</small></dt>
          <dd>Every message of the bus, for <code>scm replay</code>, <code>scm mismatch</code> and other MCAP tools.</dd>
          <dd><a class="file" href="${at}.mcap" download data-first>${recording.name}.mcap</a></dd>
        </div>
        <div>
          <dt>Its cars as a table <small>CSV, SI units</small></dt>
          <dd>
            <select aria-label="Cars in the table" value=${vehicle} onChange=${(event) => setVehicle(event.target.value)}>
              <option value="">all cars, as the world saw them</option>
              ${cars.map((car) => html`<option value=${car.vehicle}>${car.vehicle}: its own reports</option>`)}
            </select>
          </dd>
          <dd><a class="file" href=${csv} download>${vehicle || "all cars"}.csv</a></dd>
        </div>
        <div>
          <dt>For Foxglove <small>MCAP with Foxglove's own schemas</small></dt>
          <dd>
            Open the first file in Foxglove, then “Import layout from file” with the second: cars on their roads,
            signals, pictures, speeds, the log.
          </dd>
          <dd class="two">
            <a class="file" href="${at}/foxglove.mcap" download>${recording.name}.foxglove.mcap</a>
            <a class="file" href="/static/foxglove_layout.json" download="scm_foxglove_layout.json">layout</a>
          </dd>
        </div>
      </dl>
      <div class="actions"><button onClick=${onClose}>Close</button></div>
    <//>
  `;
}
