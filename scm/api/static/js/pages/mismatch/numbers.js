/** For experts: errors on the three parts, the car's own numbers, and everything that was tried. */
import { html } from "scm/shared/html.js";
import { scale } from "scm/pages/mismatch/plot.js";
import { alike, errorName, short, unitText } from "scm/pages/mismatch/words.js";

const PARTS = ["fit", "choose", "confirm"];
const TITLES = { fit: "Fit", choose: "Choose", confirm: "Confirm" };
const MOST_TRIED = 14;
const MOST_OWN = 12;

export function FitTable({ fit }) {
  const names = [...new Set(PARTS.flatMap((part) => Object.keys(fit[part].before)))];
  return html`
    <section class="panel fit" aria-label="Errors of free runs">
      <div class="panel-head">
        <h2>Errors after ${fit.horizon_s} s <small>root mean squares of free runs</small></h2>
      </div>
      <div class="scroll" tabindex="0" role="region" aria-label="Table of errors">
        <table>
          <thead>
            <tr>
              <th>Part</th>
              <th class="number">Before</th>
              <th class="number">After</th>
              <th class="number">Noise</th>
            </tr>
          </thead>
          ${names.map((name) => html`<${Rows} key=${name} name=${name} fit=${fit} />`)}
        </table>
      </div>
      <p class="hint">
        The fit saw the first part; effects were chosen on the second; the third only confirms. Windows:
        ${" "}${PARTS.map((part) => `${fit[part].windows} to ${part}`).join(", ")}.
      </p>
    </section>
  `;
}

function Rows({ name, fit }) {
  const { words, unit } = errorName(name);
  return html`
    <tbody>
      <tr><th colspan="4" scope="rowgroup">${words}</th></tr>
      ${PARTS.map((part) => {
        const { before, after, noise_floor: noise } = fit[part];
        const [was, now, floor] = alike([before[name], after[name], noise[name]], unit);
        return html`
          <tr key=${part} class=${part}>
            <td>${TITLES[part]}</td>
            <td class="number">${was}</td>
            <td class="number"><b>${now}</b></td>
            <td class="number">${floor}</td>
          </tr>
        `;
      })}
    </tbody>
  `;
}

/** The car file's own numbers, moved by the fit: in units of the scatter that the file states. */
export function OwnNumbers({ numbers }) {
  const shown = numbers.filter((one) => one.given_std > 0 && one.found.value !== null);
  if (!shown.length) return null;
  const moved = (one, value) => (value - one.given) / one.given_std;
  const size = (one) => Math.abs(moved(one, one.found.value));
  const sorted = shown.toSorted((a, b) => size(b) - size(a));
  const far = shown.flatMap((one) => [moved(one, one.found.low), moved(one, one.found.high)].map(Math.abs));
  const wide = Math.min(6, Math.max(2.5, ...far));
  return html`
    <section class="panel own" aria-label="The car's own numbers">
      <div class="panel-head">
        <h2>The car's own numbers <small>with 90 % intervals</small></h2>
      </div>
      <ul>${sorted.slice(0, MOST_OWN).map((one) => html`<${Own} key=${one.key} one=${one} moved=${moved} wide=${wide} />`)}</ul>
      ${sorted.length > MOST_OWN &&
      html`
        <details>
          <summary>${sorted.length - MOST_OWN} that moved less</summary>
          <ul>${sorted.slice(MOST_OWN).map((one) => html`<${Own} key=${one.key} one=${one} moved=${moved} wide=${wide} />`)}</ul>
        </details>
      `}
      <p class="hint">Inner area: one standard deviation as the car file states it; outer: two. Inside, the file was right.</p>
    </section>
  `;
}

function Own({ one, moved, wide }) {
  const { low, value, high, unit } = one.found;
  const at = { low: moved(one, low), value: moved(one, value), high: moved(one, high) };
  return html`
    <li>
      <span class="what">${one.key}</span>
      <${Dot} at=${at} wide=${wide} />
      <span class="number">${short(one.given)} → <b>${short(value)}</b> ${unitText(unit)}</span>
    </li>
  `;
}

function Dot({ at, wide }) {
  const x = scale(-wide, wide, 0, 200);
  const inside = (value) => x(Math.max(-wide, Math.min(wide, value)));
  return html`
    <svg width="100%" height="22" viewBox="0 0 200 22" preserveAspectRatio="none" aria-hidden="true">
      <path class="prior" d="M${x(-2)} 0H${x(2)}V22H${x(-2)}Z" />
      <path class="prior core" d="M${x(-1)} 0H${x(1)}V22H${x(-1)}Z" />
      <path class="zero" d="M${x(0)} 0V22" />
      <path class="whisker" d="M${inside(at.low)} 11H${inside(at.high)}" />
      <path class="dot" d="M${inside(at.value)} 11h0.01" />
    </svg>
  `;
}

/** Every effect that was tried alone: how much it would explain, against what chance brings. */
export function Tried({ tried, found }) {
  if (!tried.length) return null;
  const shown = tried.slice(0, MOST_TRIED);
  const most = Math.max(...shown.map((one) => Math.max(one.gain, one.needed))) || 1;
  const root = (value) => 100 * Math.sqrt(Math.max(0, value) / most);
  return html`
    <section class="panel tried" aria-label="What was tried">
      <div class="panel-head">
        <h2>What was tried <small>${tried.length} effects, each alone</small></h2>
      </div>
      <ul>
        ${shown.map(
          (one) => html`
            <li key=${one.name} class=${found.has(one.name) ? "found" : ""}>
              <span class="what">${one.title}${found.has(one.name) ? " ●" : ""}</span>
              <span class="track">
                <span class="bar" style=${{ width: `${root(one.gain)}%` }}></span>
                <i style=${{ left: `${root(one.needed)}%` }}></i>
              </span>
              <span class="number">${short(one.gain)}</span>
            </li>
          `,
        )}
      </ul>
      <p class="hint">
        Gain in squared standard deviations, drawn by its root. Line: what chance alone brings among so many. ● was found;
        others beyond their line explain some of the same, and less well.
      </p>
    </section>
  `;
}
