/** The stations on the bus, behind a line with their numbers: parts, vehicles and clients, and those lost. */
import { html } from "scm/shared/html.js";
import { span } from "scm/shared/format.js";
import { stations } from "scm/shell/store.js";

const STALE_S = 3;
/** Shares of the last minute's steps that a part left out: a healthy one on a busy machine has some. */
const LATE_SHOWN = 0.01;
const LATE_MATTERS = 0.2;
/** Open from the start where there is room. */
const first = matchMedia("(min-width: 861px)").matches;
const ROLES = { part: "part", v: "vehicle" };

export function StationsPanel() {
  const alive = stations.value.filter((station) => station.alive).length;
  const lost = stations.value.length - alive;
  return html`
    <details class="panel stations" open=${first}>
      <summary>
        <h2>Stations <small>${alive} here${lost ? html`, <span class="warn">${lost} lost</span>` : ""}</small></h2>
      </summary>
      <div class="scroll moves" tabindex="0" role="region" aria-label="List of stations">
        <p class="heads" aria-hidden="true"><span>reports</span><span>late in the last minute</span><span>received</span></p>
        <ul>
          ${stations.value.map((row) => html`<${Station} key=${row.role + row.name + row.session} row=${row} />`)}
        </ul>
        ${!stations.value.length && html`<p class="empty">Nobody is on the bus yet.</p>`}
      </div>
    </details>
  `;
}

function Station({ row }) {
  const silent = row.age_s !== null && row.age_s > STALE_S;
  const state = !row.alive ? "lost" : silent ? "stale" : "alive";
  const late = row.alive ? (row.late_share ?? 0) : 0;
  const dropped = row.alive ? row.dropped_lately : 0;
  const notes = [
    late >= LATE_SHOWN && `${Math.round(100 * late)} % late`,
    dropped > 0 && `${dropped} dropped`,
  ].filter(Boolean);
  const matters = late >= LATE_MATTERS || dropped > 0;
  return html`
    <li data-station=${row.name} data-state=${state} title="session ${row.session}">
      <i aria-hidden="true"></i>
      <b>${row.name}</b>
      <span class="detail" title=${row.detail}>${row.alive ? row.detail || ROLES[row.role] || row.role : "lost"}</span>
      <span class="late ${matters ? "warn" : ""}" title="In the last minute; since its start ${row.late_steps} steps late, ${row.dropped} messages dropped">${notes.join(", ")}</span>
      <span class="age">${row.age_s === null ? "" : span(row.age_s)}</span>
    </li>
  `;
}
