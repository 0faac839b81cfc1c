/** One change: what it is, since when, how sure, and which drive would decide. */
import { amounts, nameOf, percent } from "scm/shared/amounts.js";
import { clock, moment, span, spaced } from "scm/shared/format.js";
import { html } from "scm/shared/html.js";
import { ago } from "scm/shared/twins.js";
import { Deciding } from "scm/pages/twins/deciding.js";
import { CAUSES, changeInWords, hasReport, SEARCHES } from "scm/pages/twins/words.js";

const LEAST_SHOWN = 0.05; // of probabilities

export function Change({ vehicle, change, now_ns, onChanged }) {
  const [word, meaning] = SEARCHES[change.search];
  const [size] = amounts(change.parameter, [change.size], { unit: change.unit });
  const isNamed = change.effects.length > 0;
  const why = change.search === "failed" ? change.text : meaning;
  return html`
    <article class="panel change" data-search=${change.search} aria-label="Change at ${moment(change.since_ns)}">
      <div class="panel-head">
        <h2>${changeInWords(change)}</h2>
        <span class="search" data-search=${change.search}>${word}</span>
      </div>
      ${!isNamed && why && html`<p class="quiet">${why}</p>`}
      <dl>
        <dt>Since</dt>
        <dd>${moment(change.since_ns)} <small>${ago(change.since_ns, now_ns)}, ${interval(change)} with 90 %</small></dd>
        <dt>Noticed</dt>
        <dd>${span((change.noticed_ns - change.since_ns) / 1e9)} later <small>${change.score.toFixed(0)} standard deviations beyond what is usual</small></dd>
        ${change.causes.length > 0 && html`<dt>Whose</dt><dd>${whose(change)}</dd>`}
        ${!isNamed && html`<dt>As by</dt><dd>${spaced(change.effect)}, ${nameOf(change.parameter)} changed by ${size}</dd>`}
      </dl>
      ${change.effects.map((effect) => html`<${Effect} key=${effect.name} effect=${effect} />`)}
      ${change.drive_this && html`<p class="decides"><b>Drive this to decide${ofWhat(change)}:</b> ${change.drive_this}</p>`}
      <${Deciding} vehicle=${vehicle} change=${change} now_ns=${now_ns} onChanged=${onChanged} />
      ${hasReport(change) && html`<p><a href="/mismatch/${change.report}">Report of the search${change.drive_this ? ", with this drive" : ""}</a></p>`}
    </article>
  `;
}

/** Between which moments it began. */
const interval = ({ since_low_ns, since_high_ns }) => `between ${clock(since_low_ns)} and ${clock(since_high_ns)}`;

/** Whose it is, or may be, each with its probability. */
function whose({ cause, causes }) {
  const shown = cause === "undecided" ? causes.filter(({ probability }) => probability >= LEAST_SHOWN) : causes.slice(0, 1);
  const words = shown.map((one) => html`${CAUSES[one.kind](one)} <small>${percent(one.probability)}</small>`);
  return cause === "undecided" ? html`undecided: ${words.map((one, k) => [k ? ", " : "", one])}` : words;
}

/** What is open, where the heading says something else. */
const ofWhat = ({ effects, between }) => (effects.length && between.length ? ` between ${between.map(spaced).join(" and ")}` : "");

function Effect({ effect }) {
  return html`
    <div class="scroll" tabindex="0" role="region" aria-label="Parameters of ${spaced(effect.name)}">
      <table>
        <caption>${spaced(effect.name)} <small>${percent(effect.probability)} sure</small></caption>
        <thead><tr><th>Parameter</th><th class="number">Now</th><th class="number">90 % interval</th><th class="number">Before</th></tr></thead>
        <tbody>${effect.parameters.map((one) => html`<${Parameter} key=${one.name} parameter=${one} />`)}</tbody>
      </table>
    </div>
  `;
}

function Parameter({ parameter: { name, value, low, high, unit, before } }) {
  const [now, least, most, then] = amounts(name, [value, low, high, before], { unit, width: high - low });
  return html`
    <tr>
      <td>${nameOf(name)}</td><td class="number">${now}</td>
      <td class="number">${least} to ${most}</td><td class="number">${before === null ? "not there" : then}</td>
    </tr>
  `;
}
