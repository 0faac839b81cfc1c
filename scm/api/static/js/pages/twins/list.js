/** All watched cars: how each is, by which version it is predicted, and what changed last. */
import { html } from "scm/shared/html.js";
import { byName, span, UNKNOWN } from "scm/shared/format.js";
import { ago, twinRows } from "scm/shared/twins.js";
import { capital, SEARCHES } from "scm/pages/twins/words.js";
import { Nobody, PartLost, TwinState } from "scm/pages/twins/watching.js";

export function List() {
  const rows = twinRows();
  if (!rows?.length) return html`<${Nobody} />`;
  return html`
    <section class="panel all" aria-label="Watched cars">
      <div class="panel-head">
        <h2>Is each car what its file says? <small>${rows.length === 1 ? "1 car" : `${rows.length} cars`}</small></h2>
      </div>
      <${PartLost} />
      <div class="scroll" tabindex="0" role="region" aria-label="Table of watched cars">
        <table>
          <thead>
            <tr>
              <th>Name</th><th>State</th><th class="wide">Car file</th><th class="number wide">Driven</th>
              <th class="number wide">Version</th><th class="number wide">Changes</th><th>Newest change</th>
            </tr>
          </thead>
          <tbody>
            ${rows.toSorted((a, b) => byName(a.vehicle, b.vehicle)).map((row) => html`<${Row} key=${row.vehicle} row=${row} />`)}
          </tbody>
        </table>
      </div>
    </section>
  `;
}

function Row({ row }) {
  return html`
    <tr data-car=${row.vehicle}>
      <td><a class="to" href="/twins/${row.vehicle}">${row.vehicle}</a></td>
      <td><${TwinState} state=${row.state} /></td>
      <td class="wide">${row.car}</td>
      <td class="number wide">${span(row.driven_s)}</td>
      <td class="number wide">${row.version}</td>
      <td class="number wide">${row.changes || UNKNOWN}</td>
      <td class="wraps"><${Newest} row=${row} /></td>
    </tr>
  `;
}

function Newest({ row }) {
  if (row.state === "blind") return html`<span class="bad">${capital(row.reason)}</span>`;
  if (row.changed_ns === null) return html`<span class="quiet">none noticed</span>`;
  return html`
    <span class="search" data-search=${row.search}>${SEARCHES[row.search][0]}</span>
    ${capital(row.newest)} <small>${ago(row.changed_ns, row.t_ns)}</small>
  `;
}
