/** What signs, colours and lengths on the map mean. */
import { html } from "scm/shared/html.js";
import { fastest } from "scm/pages/map/heat.js";
import { layers } from "scm/pages/map/layers.js";
import { viewChanged } from "scm/pages/map/viewport.js";

const KINDS = ["hosted", "remote", "real", "lost"];
const MOST_PX = 110;
const NARROW_PARTS = 4; // on a narrow map the bar is at most a quarter of it
const STEPS = [1, 2, 5];

export function Kinds() {
  return html`
    <ul class="legend" aria-label="Kinds of cars">
      ${KINDS.map((kind) => html`<li key=${kind}><i data-kind=${kind}></i>${kind}</li>`)}
    </ul>
  `;
}

export function HeatKey() {
  if (!layers.value.heat) return null;
  return html`
    <div class="legend heat-key" role="img" aria-label="Mean speed by colour: dark is 0, bright is ${fastest.value.toFixed(1)} m/s">
      <span>0</span><i class="ramp"></i><span>${fastest.value.toFixed(1)} m/s</span>
    </div>
  `;
}

/** The longest round length that fits. */
export function ScaleBar({ view }) {
  viewChanged.value;
  const most = Math.min(MOST_PX, view.width / NARROW_PARTS) / view.scale;
  const power = 10 ** Math.floor(Math.log10(most));
  const length = power * STEPS.findLast((step) => step * power <= most);
  const words = length < 1 ? `${Math.round(100 * length)} cm` : `${length} m`;
  return html`
    <div class="legend scale" role="img" aria-label="Scale: this bar is ${words}">
      <i style=${{ width: `${length * view.scale}px` }}></i>${words}
    </div>
  `;
}
