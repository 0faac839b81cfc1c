/** Effects as curves: what each does against what it depends on, with its 90 % band. */
import { html } from "scm/shared/html.js";
import { area, ends, Grid, line, scale, useWidth } from "scm/pages/mismatch/plot.js";
import { short, unitText } from "scm/pages/mismatch/words.js";

export function Curves({ curves, effects }) {
  if (!curves.length) return null;
  const title = (curve) => effects.find((effect) => effect.name === curve.effect)?.title ?? curve.effect;
  return html`
    <section class="panel curves" aria-label="The effects as curves">
      <div class="panel-head"><h2>The effects as curves <small>with 90 % bands</small></h2></div>
      ${curves.map((curve, i) => html`<${Curve} key=${i} curve=${curve} title=${title(curve)} />`)}
    </section>
  `;
}

function Curve({ curve, title }) {
  const [ref, width] = useWidth();
  const height = 220;
  const box = { left: 56, right: width - 8, top: 26, bottom: height - 40 };
  const [x0, x1] = ends([curve.x]);
  const [y0, y1] = ends([curve.y, curve.low, curve.high]);
  const pad = 0.06 * (y1 - y0 || 1);
  const x = scale(x0, x1, box.left, box.right);
  const y = scale(y0 - pad, y1 + pad, box.bottom, box.top);
  const named = (name, unit) => (unit === "1" ? name : `${name} [${unitText(unit)}]`);
  return html`
    <figure ref=${ref}>
      <figcaption>${title}</figcaption>
      <svg width=${width} height=${height} role="img" aria-label="${title}: ${curve.y_name} against ${curve.x_name}">
        <${Grid}
          x=${x}
          y=${y}
          box=${box}
          across=${named(curve.x_name, curve.x_unit)}
          up=${named(curve.y_name, curve.y_unit)}
          write=${short}
        />
        <path class="band" d=${area(curve.x, curve.low, curve.high, x, y)} />
        <path class="curve after" d=${line(curve.x, curve.y, x, y)} />
      </svg>
    </figure>
  `;
}
