/** What SPaT published against what happened: broken guarantees, and the errors of likely ends. */
import { signal } from "@preact/signals";
import { html } from "scm/shared/html.js";
import { fixed, UNKNOWN } from "scm/shared/format.js";
import { score } from "scm/pages/signals/store.js";

const EDGES_S = [-5, -2, -1, -0.5, -0.25, 0.25, 0.5, 1, 2, 5];
const SHARE = (value) => (value === null ? UNKNOWN : `${Math.round(100 * value)} %`);
const lead = signal(5);

export function GuaranteedTimes() {
  const published = score.value;
  if (!published) {
    return html`
      <section class="panel guaranteed-times" aria-label="Guaranteed times">
        <h2>Guaranteed times</h2>
        <p class="empty">Reading what SPaT published…</p>
      </section>
    `;
  }
  const broken = published.early + published.late;
  const leads = [...new Set(published.leads.map((one) => one.lead_s))];
  return html`
    <section class="panel guaranteed-times" aria-label="Guaranteed times">
      <div class="panel-head">
        <h2>Guaranteed times <small>of SPaT against what happened, last ${published.kept_s / 60} min</small></h2>
      </div>
      <dl class="facts">
        <div data-state=${published.judged ? (broken ? "bad" : "good") : "none"}>
          <dt>broken</dt>
          <dd>${broken} <small>of ${published.judged}</small></dd>
        </div>
        <div><dt>too early</dt><dd>${published.early}</dd></div>
        <div><dt>too late</dt><dd>${published.late}</dd></div>
        <div><dt>no latest end</dt><dd>${published.open}</dd></div>
        <div><dt>cut by flash</dt><dd>${published.cut}</dd></div>
      </dl>
      ${published.judged
        ? html`<${Leads} published=${published} /><${Histogram} published=${published} leads=${leads} />`
        : html`<p class="empty">No colour has ended yet since the page's server began to listen.</p>`}
    </section>
  `;
}

function Leads({ published }) {
  return html`
    <div class="scroll" tabindex="0" role="region" aria-label="Table of likely ends"><table>
      <caption class="hidden">Likely ends as published before the end, against the end</caption>
      <thead>
        <tr>
          <th scope="col">Likely end</th>
          <th scope="col" class="number">published</th>
          <th scope="col" class="number">mean</th>
          <th scope="col" class="number">worst</th>
          <th scope="col" class="number">within 1 s</th>
          <th scope="col" class="number">confidence</th>
        </tr>
      </thead>
      <tbody>
        ${published.leads
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

/** How many likely ends were off by how much: bars as rectangles, without a picture. */
function Histogram({ published, leads }) {
  const errors = published.leads.filter((one) => one.lead_s === lead.value).flatMap((one) => one.errors_s);
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
        Likely end, published too early or too late
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
