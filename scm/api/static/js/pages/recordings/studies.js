/** Studies: how far each is and how many of its cases are a success; its page opens in a new tab. */
import { coded } from "scm/shared/coded.js";
import { html } from "scm/shared/html.js";
import { placed } from "scm/shared/base.js";
import { UNKNOWN } from "scm/shared/format.js";
import { Tabs } from "scm/pages/recordings/tabs.js";
import { useFetched } from "scm/shared/fetched.js";
import { moment } from "scm/pages/recordings/words.js";

const EVERY_MS = 4000;

export function Studies() {
  const { body, error } = useFetched("/studies?limit=500", EVERY_MS);
  return html`
    <${Tabs} here="studies" />
    <section class="panel list studies" aria-label="Studies">
      ${error && html`<p class="form-error" role="alert">The list could not be read: ${coded(error)}</p>`}
      ${!body && !error && html`<p class="empty">Reading the list…</p>`}
      ${body && !body.items.length && html`<${Nothing} />`}
      ${body && body.items.length > 0 && html`<${Table} rows=${body.items} />`}
    </section>
  `;
}

function Nothing() {
  return html`
    <p class="empty">
      No study was run yet. <code>scm study run FILE</code> runs one scenario in many cities; <code>docs/studies.md</code> shows how to write its file.
    </p>
  `;
}

function Table({ rows }) {
  return html`
    <div class="scroll" tabindex="0" role="region" aria-label="Table of studies">
      <table>
        <thead>
          <tr>
            <th>Study</th><th class="wide">Began</th><th class="number">Cases</th>
            <th class="wide">Success</th><th>State</th>
          </tr>
        </thead>
        <tbody>${rows.map((row) => html`<${Row} key=${row.name} row=${row} />`)}</tbody>
      </table>
    </div>
  `;
}

function Row({ row }) {
  const isReadable = row.state !== "unreadable";
  const page = placed(`/api/v1/studies/${encodeURIComponent(row.name)}/page`);
  const open = (event) => event.target.closest("a") || window.open(page, "_blank", "noopener");
  const { error, time_limit, memory_limit } = row.outcomes;
  const unended = error + time_limit + memory_limit;
  return html`
    <tr data-study=${row.name} data-state=${row.state} onClick=${isReadable ? open : null}>
      <td class="what">
        ${isReadable ? html`<a href=${page} target="_blank" rel="noopener">${row.title || row.name}</a>` : html`<b>${row.name}</b>`}
        ${row.title && html`<small>${row.name}</small>`}
        ${row.success && html`<small class="slim">success ${share(row.success)}</small>`}
        ${row.trouble && html`<small class="why">${row.trouble}</small>`}
        ${unended > 0 && html`<small class="why">${unended === 1 ? "1 case" : `${unended} cases`} did not end</small>`}
      </td>
      <td class="wide">${row.began_ns ? moment(row.began_ns) : UNKNOWN}</td>
      <td class="number">
        ${isReadable &&
        html`
          ${row.done} of ${row.cases}
          <progress max=${row.cases || 1} value=${row.done} aria-label="Progress of ${row.name}"></progress>
        `}
      </td>
      <td class="wide">${row.success ? share(row.success) : UNKNOWN}</td>
      <td><span class="state" data-state=${row.state}>${row.state}</span></td>
    </tr>
  `;
}

/** `78.8 % [74.9, 82.2]`: a share with its 95 % interval. */
function share({ value, low, high }) {
  const percent = (number) => (100 * number).toFixed(1);
  return `${percent(value)} % [${percent(low)}, ${percent(high)}]`;
}
