/** What SPaT told against what happened: broken promises, and how far likely ends were off. */
import { signal } from "@preact/signals";
import { html } from "scm/shared/html.js";
import { fixed, UNKNOWN } from "scm/shared/format.js";
import { score } from "scm/pages/signals/store.js";

const EDGES_S = [-5, -2, -1, -0.5, -0.25, 0.25, 0.5, 1, 2, 5];
const SHARE = (value) => (value === null ? UNKNOWN : `${Math.round(100 * value)} %`);
const lead = signal(5);

export function Promises() {
  const told = score.value;
  if (!told) {
    return html`
      <section class="panel promises" aria-label="Promises">
        <h2>SPaT promises</h2>
        <p class="empty">Reading what was told…</p>
      </section>
    `;
  }
  const broken = told.early + told.late;
  const leads = [...new Set(told.leads.map((one) => one.lead_s))];
  return html`
    <section class="panel promises" aria-label="Promises">
      <div class="panel-head">
        <h2>SPaT promises <small>against what happened, last ${told.kept_s / 60} min</small></h2>
      </div>
      <dl class="facts">
        <div data-state=${told.judged ? (broken ? "bad" : "good") : "none"}>
          <dt>broken</dt>
          <dd>${broken} <small>of ${told.judged}</small></dd>
        </div>
        <div><dt>too early</dt><dd>${told.early}</dd></div>
        <div><dt>too late</dt><dd>${told.late}</dd></div>
        <div><dt>no latest end</dt><dd>${told.open}</dd></div>
        <div><dt>cut by flash</dt><dd>${told.cut}</dd></div>
      </dl>
      ${told.judged
        ? html`<${Leads} told=${told} /><${Histogram} told=${told} leads=${leads} />`
        : html`<p class="empty">No colour has ended yet since the page's server listens.</p>`}
    </section>
  `;
}

function Leads({ told }) {
  return html`
    <div class="scroll" tabindex="0" role="region" aria-label="Table of promises"><table>
      <caption class="hidden">Likely ends as told before the end, against the end</caption>
      <thead>
        <tr>
          <th scope="col">Likely end</th>
          <th scope="col" class="number">told</th>
          <th scope="col" class="number">mean</th>
          <th scope="col" class="number">worst</th>
          <th scope="col" class="number">within 1 s</th>
          <th scope="col" class="number">said sure</th>
        </tr>
      </thead>
      <tbody>
        ${told.leads
          .filter((one) => one.errors_s.length || one.unknown)
          .map(
            (one) => html`
              <tr key=${one.colour + one.lead_s}>
                <td><i class="dot" data-colour=${one.colour}></i>${one.colour}, ${one.lead_s} s ahead</td>
                <td class="number">${one.errors_s.length}<small>/${one.errors_s.length + one.unknown}</small></td>
                <td class="number">${fixed(one.mean_s, 1, " s")}</td>
                <td class="number">${fixed(one.worst_s, 1, " s")}</td>
                <td class="number">${SHARE(one.within)}</td>
                <td class="number">${SHARE(one.told)}</td>
              </tr>
            `,
          )}
      </tbody>
    </table></div>
  `;
}

/** How many likely ends were off by how much: bars as rectangles, so that the page needs no picture. */
function Histogram({ told, leads }) {
  const errors = told.leads.filter((one) => one.lead_s === lead.value).flatMap((one) => one.errors_s);
  const counts = Array(EDGES_S.length + 1).fill(0);
  for (const error of errors) {
    const at = EDGES_S.findIndex((edge) => error < edge);
    counts[at < 0 ? EDGES_S.length : at] += 1;
  }
  const most = Math.max(1, ...counts);
  const label = (at) =>
    at === 0 ? `< ${EDGES_S[0]}` : at === EDGES_S.length ? `> ${EDGES_S.at(-1)}` : `${EDGES_S[at - 1]} to ${EDGES_S[at]}`;
  const words = counts
    .map((count, at) => (count ? `${count} off by ${label(at)} s` : ""))
    .filter(Boolean)
    .join("; ");
  return html`
    <figure class="histogram">
      <figcaption>
        Likely end, told too early or too late
        <select
          aria-label="How long before the end"
          value=${String(lead.value)}
          onChange=${(event) => (lead.value = Number(event.target.value))}
        >
          ${leads.map((one) => html`<option key=${one} value=${String(one)}>${one} s before</option>`)}
        </select>
      </figcaption>
      <div class="bins" role="img" aria-label=${words || "no forecast was judged"}>
        ${counts.map(
          (count, at) => html`
            <div key=${at} title="${count} off by ${label(at)} s">
              <b>${count || ""}</b>
              <i data-near=${at === 5} style=${{ height: `${Math.round((52 * count) / most)}px` }}></i>
              <small>${at === 0 ? "early" : at === 5 ? "0" : at === EDGES_S.length ? "late" : ""}</small>
            </div>
          `,
        )}
      </div>
    </figure>
  `;
}
