/** Free runs: the simulator driven again by the recorded commands, before and after, beside the recording. */
import { useMemo, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { ends, Grid, line, scale, useWidth } from "scm/pages/mismatch/plot.js";
import { length, short } from "scm/pages/mismatch/words.js";

const SIDES = ["measured", "before", "after"];
const WORDS = { fit: "the fit saw it", choose: "effects were chosen on it", confirm: "no fit has seen it" };

export function FreeRuns({ runs }) {
  const worst = useMemo(() => worstOf(runs), [runs]);
  const [at, setAt] = useState(worst);
  const part = runs.part[at];
  const last = (side) => errors(runs, side, at).findLast((value) => value !== null) ?? null;
  const told = `Window ${at + 1} of ${runs.part.length}, from ${short(runs.start_s[at])} s: ${WORDS[part] ?? part}.`;
  return html`
    <section class="panel runs" aria-label="Free runs">
      <div class="panel-head">
        <h2>Driven again <small>before and after, beside the recording</small></h2>
        <button class="small" onClick=${() => setAt(worst)}>Worst unseen window</button>
      </div>
      <input
        type="range"
        min="0"
        max=${runs.part.length - 1}
        value=${at}
        aria-label="Window"
        aria-valuetext=${told}
        onInput=${(event) => setAt(Number(event.target.value))}
      />
      <div class="legend-line">
        <span>${told}</span>
        <span class="key measured">recording</span>
        <span class="key before">before, ends ${length(last("before"))} off</span>
        <span class="key after">after, ${length(last("after"))}</span>
      </div>
      <div class="two">
        <${OnFloor} runs=${runs} at=${at} />
        <${Growing} runs=${runs} at=${at} />
      </div>
    </section>
  `;
}

/** Distance to the recording [m] at each time of a window. */
function errors(runs, side, at) {
  const { measured } = runs;
  return runs.t_s.map((_, k) => {
    const points = [runs[side].x, runs[side].y, measured.x, measured.y].map((rows) => rows[at][k]);
    return points.includes(null) ? null : Math.hypot(points[0] - points[2], points[1] - points[3]);
  });
}

function worstOf(runs) {
  const unseen = runs.part.map((part, i) => [part, i]).filter(([part]) => part === "confirm");
  const among = (unseen.length ? unseen : runs.part.map((part, i) => [part, i])).map(([, i]) => i);
  const end = (i) => errors(runs, "before", i).findLast((value) => value !== null) ?? -1;
  return among.reduce((best, i) => (end(i) > end(best) ? i : best), among[0] ?? 0);
}

function OnFloor({ runs, at }) {
  const [ref, width] = useWidth();
  const height = 260;
  const pad = 18;
  const xs = SIDES.map((side) => runs[side].x[at]);
  const ys = SIDES.map((side) => runs[side].y[at]);
  const [x0, x1] = ends(xs);
  const [y0, y1] = ends(ys);
  const per_m = Math.min((width - 2 * pad) / Math.max(x1 - x0, 0.05), (height - 3 * pad) / Math.max(y1 - y0, 0.05));
  const x = (value) => width / 2 + (value - (x0 + x1) / 2) * per_m;
  const y = (value) => (height - pad) / 2 - (value - (y0 + y1) / 2) * per_m;
  const bar = [5, 2, 1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01].find((one) => one * per_m < 120) ?? 0.01;
  const first = xs[0].findIndex((value) => value !== null);
  return html`
    <figure ref=${ref}>
      <svg width=${width} height=${height} role="img" aria-label="The window on the floor">
        ${SIDES.map((side, i) => html`<path key=${side} class="curve ${side}" d=${line(xs[i], ys[i], x, y)} />`)}
        ${first >= 0 && html`<circle class="start" cx=${x(xs[0][first])} cy=${y(ys[0][first])} r="4.5" />`}
        <g class="scale-bar">
          <path d="M12 ${height - 8}h${bar * per_m}" />
          <text x=${18 + bar * per_m} y=${height - 4}>${length(bar)}</text>
        </g>
      </svg>
    </figure>
  `;
}

function Growing({ runs, at }) {
  const [ref, width] = useWidth();
  const height = 260;
  const box = { left: 48, right: width - 8, top: 24, bottom: height - 40 };
  const before = errors(runs, "before", at);
  const after = errors(runs, "after", at);
  const cm = (list) => list.map((value) => (value === null ? null : 100 * value));
  const x = scale(0, runs.t_s.at(-1), box.left, box.right);
  const [, high] = ends([cm(before), cm(after)], 0);
  const y = scale(0, 1.08 * (high || 1), box.bottom, box.top);
  return html`
    <figure ref=${ref}>
      <svg width=${width} height=${height} role="img" aria-label="Error over time in the window">
        <${Grid} x=${x} y=${y} box=${box} across="time in the window [s]" up="position error [cm]" write=${short} />
        <path class="curve before" d=${line(runs.t_s, cm(before), x, y)} />
        <path class="curve after" d=${line(runs.t_s, cm(after), x, y)} />
      </svg>
    </figure>
  `;
}
