/** What the chosen car's planners avoid: how far each place is from the nearest obstacle, as heat. */
import { computed, effect, signal } from "@preact/signals";
import { autonomyOf } from "scm/shared/autonomy.js";
import { placed } from "scm/shared/base.js";
import { html } from "scm/shared/html.js";
import { selected } from "scm/shared/selection.js";
import { drawGrid, painted, unpacked } from "scm/pages/map/grid_picture.js";
import { layers } from "scm/pages/map/layers.js";

const POLL_MS = 1000;
const FAR_M = 0.3; // from obstacles, where the heat ends
const SOLID = [94, 10, 84, 170];
/** From the car's half width to `FAR_M`: red, orange, yellow, nothing. */
const SCALE = [
  [214, 40, 57, 125],
  [247, 127, 0, 100],
  [252, 211, 77, 60],
  [252, 237, 160, 0],
];

/** Name of the car whose costmap is shown: its agent has one once it has a goal; empty: none. */
const watched = computed(() => {
  const row = layers.value.costmap && selected.value ? autonomyOf(selected.value) : null;
  return row && row.goal_x_m !== null ? row.vehicle : "";
});

/** `{grid, picture}` of that car; null: none yet. */
const shown = signal(null);

/** Poll the costmap that is shown; returns the function that ends it. */
export function pollCostmap() {
  return effect(() => {
    const name = watched.value;
    shown.value = null;
    if (!name) return undefined;
    let ended = false;
    let timer = null;
    const poll = async () => {
      const response = document.hidden ? null : await fetch(placed(`/api/v1/vehicles/${name}/costmap`)).catch(() => null);
      const grid = response?.ok ? await response.json().catch(() => null) : null;
      const cells = grid && (await unpacked(grid.payload).catch(() => null));
      if (ended) return;
      if (cells) shown.value = { grid, picture: painted(cells, grid, (value) => heatOf(value * grid.step_m, grid)) };
      timer = setTimeout(poll, POLL_MS);
    };
    poll();
    return () => {
      ended = true;
      clearTimeout(timer);
    };
  });
}

export function drawCostmap(paper, view) {
  const now = shown.peek();
  if (now) drawGrid(paper, view, now.picture, now.grid);
}

function heatOf(far_m, { half_width_m }) {
  if (far_m <= 0) return SOLID;
  const share = Math.min(1, Math.max(0, (far_m - half_width_m) / (FAR_M - half_width_m)));
  const at = Math.min(0.9999, share) * (SCALE.length - 1);
  const [low, high, part] = [SCALE[Math.floor(at)], SCALE[Math.floor(at) + 1], at % 1];
  return low.map((value, i) => Math.round(value + part * (high[i] - value)));
}

/** What the heat means, while there is any. */
export function CostmapKey() {
  if (!shown.value) return null;
  const inside = `${Math.round(100 * shown.value.grid.half_width_m)} cm`;
  const far = `${100 * FAR_M} cm`;
  return html`
    <div class="legend costmap-key" role="img" aria-label="Costmap, by the way to the nearest obstacle: red is half of the car's width, ${inside}, or less; clear is ${far} or more">
      <i class="solid"></i>obstacle <span>≤ ${inside} from it</span><i class="ramp"></i><span>${far}</span>
    </div>
  `;
}
