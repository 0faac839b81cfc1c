/** The list: what was recorded, the newest first. */
import { coded } from "scm/shared/coded.js";
import { html } from "scm/shared/html.js";
import { Tabs } from "scm/pages/recordings/tabs.js";
import { useFetched } from "scm/shared/fetched.js";
import { minutes, moment, size } from "scm/pages/recordings/words.js";
import { go, route } from "scm/shell/router.js";

const EVERY_MS = 4000;
const ROWS = 50;

export function RecordingsList() {
  const { cursor = "" } = route.value.query;
  const path = `/recordings?limit=${ROWS}${cursor && `&cursor=${encodeURIComponent(cursor)}`}`;
  const { body, error } = useFetched(path, EVERY_MS);
  return html`
    <${Tabs} here="recordings" />
    <section class="panel list" aria-label="Recordings">
      ${error && html`<p class="form-error" role="alert">The list could not be read: ${error}</p>`}
      ${!body && !error && html`<p class="empty">Reading the list…</p>`}
      ${body && html`<${Table} rows=${body.items} />`}
      ${body && !body.items.length && html`<${Nothing} />`}
      ${(cursor || body?.next) && html`<${Pages} first=${!cursor} next=${body?.next} />`}
    </section>
  `;
}

function Nothing() {
  return html`
    <p class="empty">
      Nothing was recorded yet. <code>scm up</code> records every run of the city into its folder;
      <code>scm record --out run.mcap</code> does so for a city that runs without.
    </p>
  `;
}

function Table({ rows }) {
  if (!rows.length) return null;
  return html`
    <div class="scroll" tabindex="0" role="region" aria-label="Table of recordings">
      <table>
        <thead>
          <tr>
            <th>Recording</th><th class="wide">Began</th><th class="number">Length</th>
            <th class="wide">Cars</th><th class="number wide">Size</th><th>State</th>
          </tr>
        </thead>
        <tbody>${rows.map((row) => html`<${Row} key=${row.name} row=${row} />`)}</tbody>
      </table>
    </div>
  `;
}

function Row({ row }) {
  const path = `/recordings/${encodeURIComponent(row.name)}`;
  const began = row.begin_ns ? moment(row.begin_ns) : "—";
  const open = (event) => event.target.closest("a") || go(path);
  return html`
    <tr data-recording=${row.name} data-state=${row.state} onClick=${open}>
      <td class="what">
        <a href=${path}>${row.title || row.name}</a>
        ${row.title && html`<small>${row.name}</small>`}
        <small class="slim">${row.begin_ns && `${began} · `}${counted(row.cars)} · ${size(row.size_bytes)}</small>
        ${row.trouble && html`<small class="why">${coded(row.trouble)}</small>`}
        ${row.notes && html`<small class="note">${row.notes}</small>`}
      </td>
      <td class="wide">${began}</td>
      <td class="number">${minutes(row.length_s)}</td>
      <td class="wide" title=${row.cars.join(", ")}>${cars(row.cars)}</td>
      <td class="number wide">${size(row.size_bytes)}</td>
      <td><span class="state" data-state=${row.state}>${row.state}</span></td>
    </tr>
  `;
}

function counted(names) {
  return names.length === 1 ? "1 car" : `${names.length} cars`;
}

function cars(names) {
  if (!names.length) return "—";
  return names.length > 6 ? `${names.length}: ${names.slice(0, 4).join(", ")} …` : names.join(", ");
}

function Pages({ first, next }) {
  return html`
    <nav class="pages" aria-label="Pages of the list">
      ${!first && html`<a href="/recordings">Newest</a>`}
      ${next && html`<a href="/recordings?cursor=${encodeURIComponent(next)}">Older</a>`}
    </nav>
  `;
}
