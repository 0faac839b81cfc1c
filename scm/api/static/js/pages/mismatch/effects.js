/** What was left out, one card for each effect: in words, in numbers, how sure, and which rivals fell. */
import { coded } from "scm/shared/coded.js";
import { html } from "scm/shared/html.js";
import { scale } from "scm/pages/mismatch/plot.js";
import { PARTS, short, unitText } from "scm/pages/mismatch/words.js";

const WIDE = 240;

/** @param index of the card's effect among the report's; the first cards are the effects in order */
export function EffectCard({ card, index, report, drawn }) {
  const effect = report.effects[index];
  const told = drawn.effects[index];
  if (!effect || !told) return html`<${PlainCard} card=${card} />`;
  const share = report.located.find((one) => one.equation === effect.equation)?.share_of_error ?? null;
  const rows = card.rows.filter(([name]) => name !== "How much" && name !== "Law");
  return html`
    <article class="panel effect" aria-label=${told.title}>
      <p class="label">${card.label}</p>
      <h2>${told.title}</h2>
      <p class="chips">
        <span class="chip" data-part=${effect.equation}>${PARTS[effect.equation] ?? effect.equation}</span>
        ${!effect.listed && html`<span class="chip new">outside the library</span>`}
        ${share !== null && html`<${Share} share=${share} />`}
      </p>
      ${effect.law && html`<p class="law"><code>${effect.law}</code></p>`}
      <ul class="whiskers" aria-label="How much">${told.numbers.map((one) => html`<${Whisker} key=${one.name} of=${one} />`)}</ul>
      <${Facts} rows=${rows} />
      <${Rivals} effect=${effect} titles=${told.rivals} />
    </article>
  `;
}

function Share({ share }) {
  const percent = Math.round(100 * share);
  return html`
    <span class="share">
      <span class="track"><span class="bar" style=${{ width: `${percent}%` }}></span></span>
      ${percent} % of the error
    </span>
  `;
}

/** A number with its 90 % interval, and the value at which the effect would do nothing. */
function Whisker({ of }) {
  const { value, low, high, neutral, unit } = of;
  const all = [value, low, high, neutral].filter((one) => one !== null && one !== undefined);
  const pad = 0.12 * (Math.max(...all) - Math.min(...all) || 1);
  const x = scale(Math.min(...all) - pad, Math.max(...all) + pad, 6, WIDE - 6);
  const has = neutral !== null && neutral !== undefined;
  return html`
    <li>
      <span class="what"><b>${of.name}</b> ${of.said}</span>
      <svg width="100%" height="34" viewBox="0 0 ${WIDE} 34" preserveAspectRatio="none" aria-hidden="true">
        <path class="axis" d="M0 12H${WIDE}" />
        ${has && html`<path class="neutral" d="M${x(neutral)} 2V22" />`}
        <path class="whisker" d="M${x(low)} 12H${x(high)}M${x(low)} 6V18M${x(high)} 6V18" />
        <path class="dot" d="M${x(value)} 12h0.01" />
      </svg>
      ${has && html`<small>dashed: no effect, ${short(neutral)} ${unitText(unit)}</small>`}
    </li>
  `;
}

export function Facts({ rows }) {
  return html`
    <dl>${rows.map(([name, said]) => html`<div key=${name}><dt>${name}</dt><dd>${coded(said)}</dd></div>`)}</dl>
  `;
}

function Rivals({ effect, titles }) {
  if (!effect.rivals.length) return null;
  return html`
    <details>
      <summary>${effect.rivals.length === 1 ? "One rival" : `${effect.rivals.length} rivals`} ruled out</summary>
      <ul class="rivals">
        ${effect.rivals.map(
          (rival, i) => html`
            <li key=${rival.name}>
              <b>${titles[i] ?? rival.name}</b> <small>${chance(rival.probability)}</small>
              <span>${rival.ruled_out_by}</span>
            </li>
          `,
        )}
      </ul>
    </details>
  `;
}

function chance(probability) {
  if (probability < 0.001) return "under 0.1 %";
  return `${short(100 * probability)} %`;
}

/** What the cars of one search share, and the way to each one's report. */
export function TogetherCard({ name, together }) {
  const others = together.cars.filter((car) => car !== name);
  return html`
    <article class="panel card" data-kind="together">
      <p class="label">Together with the other cars</p>
      <h2>${together.said}</h2>
      ${together.conclusions.map((said) => html`<p key=${said}>${said}</p>`)}
      <p>
        Their reports:
        ${others.map((car, i) => html`${i ? ", " : " "}<a key=${car} href="/mismatch/${car}">${car.split(".")[1]}</a>`)}
      </p>
    </article>
  `;
}

export function PlainCard({ card }) {
  return html`
    <article class="panel card" data-kind=${card.kind}>
      <p class="label">${card.label}</p>
      <h2>${card.title}</h2>
      <${Facts} rows=${card.rows} />
    </article>
  `;
}
