/** Downloads: the recording itself or a part of it, its cars as CSV, and what Foxglove draws. */
import { useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";
import { seconds, SpanFields, WHOLE } from "scm/shared/span_fields.js";
import { size } from "scm/pages/recordings/words.js";
import { finished, isOver } from "scm/shared/operation.js";
import { change } from "scm/shell/api.js";
import { go } from "scm/shell/router.js";
import { placed } from "scm/shared/base.js";

export function DownloadDialog({ recording, cars, player, onClose }) {
  const at = `/api/v1/recordings/${encodeURIComponent(recording.name)}`;
  return html`
    <${Dialog} title="Download" onClose=${onClose}>
      <dl class="files">
        <div>
          <dt>The recording <small>MCAP, ${size(recording.size_bytes)}</small></dt>
          <dd>Every message of the bus, for <code>scm replay</code>, <code>scm mismatch</code> and other MCAP tools.</dd>
          <dd><a class="file" href="${at}.mcap" download data-first>${recording.name}.mcap</a></dd>
        </div>
        <div>
          <dt>A part of it <small>a recording of its own in the list, MCAP</small></dt>
          <dd><${Part} recording=${recording} player=${player} /></dd>
        </div>
        <div>
          <dt>Its cars as a table <small>CSV, SI units</small></dt>
          <dd><${CarsAsTable} at=${at} recording=${recording} cars=${cars} player=${player} /></dd>
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

/** A part becomes a recording of its own, which is opened once it is there. */
function Part({ recording, player }) {
  const [span, setSpan] = useState(WHOLE);
  const [row, setRow] = useState(null);
  const isBusy = row !== null && !isOver(row);
  const submit = async (event) => {
    event.preventDefault();
    const { from_s, to_s } = seconds(span);
    const path = `/recordings/${encodeURIComponent(recording.name)}/parts`;
    const begun = await change("POST", path, { from_s: from_s ?? 0, to_s });
    if (!begun) return;
    const ended = await finished(begun, setRow);
    if (ended.state === "done") go(ended.result);
  };
  return html`
    <form name="part" class="fields two-by-two" onSubmit=${submit} onInput=${() => setRow(null)}>
      <${SpanFields} recording=${recording} player=${player} span=${span} onChange=${setSpan} />
      ${row?.error && html`<p class="form-error" role="alert">${row.error}</p>`}
      <button disabled=${isBusy}>${isBusy ? "Cutting…" : "Cut"}</button>
    </form>
  `;
}

/** A table of one car or of all, of all the time or of a span. */
function CarsAsTable({ at, recording, cars, player }) {
  const [vehicle, setVehicle] = useState("");
  const [span, setSpan] = useState(WHOLE);
  const [trouble, setTrouble] = useState("");
  const submit = async (event) => {
    event.preventDefault();
    const filters = Object.entries({ vehicle: vehicle || null, ...seconds(span) });
    const query = new URLSearchParams(filters.filter(([, value]) => value !== null));
    setTrouble(await downloaded(`${at}/csv?${query}`));
  };
  return html`
    <form name="table" class="fields two-by-two" onSubmit=${submit} onInput=${() => setTrouble("")}>
      <select aria-label="Cars in the table" value=${vehicle} onChange=${(event) => setVehicle(event.target.value)}>
        <option value="">all cars, as the world saw them</option>
        ${cars.map((car) => html`<option value=${car.vehicle}>${car.vehicle}: its own reports</option>`)}
      </select>
      <${SpanFields} most_s=${recording.length_s} player=${player} span=${span} onChange=${setSpan} />
      ${trouble && html`<p class="form-error" role="alert">${trouble}</p>`}
      <button>${vehicle || "all cars"}.csv</button>
    </form>
  `;
}

/** Let the browser download a file, once the server begins to send it; else return why not. */
async function downloaded(path) {
  const request = new AbortController();
  try {
    const answer = await fetch(placed(path), { signal: request.signal });
    if (!answer.ok) return (await answer.json()).detail;
  } catch (error) {
    return `The server does not answer: ${error.message}`;
  }
  request.abort();
  const link = Object.assign(document.createElement("a"), { href: path, download: "" });
  link.click();
  return "";
}
