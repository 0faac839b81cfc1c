/** A plan's cycle as a strip: each stage's green, yellow and red clear, as wide as they last. */
import { html } from "scm/shared/html.js";
import { site } from "scm/pages/signals/store.js";
import { plain, secs } from "scm/pages/signals/words.js";

/** What the timetable leaves between two stages for steps that come late. */
const RESERVE_S = 0.3;

/** What the kernel adds after a stage, by the slowest of its groups. */
export function changeOf(groups) {
  const phases = (site.value?.phases ?? []).filter((phase) => groups.includes(phase.group));
  const total = Math.max(0, ...phases.map((phase) => phase.yellow_s + phase.red_clear_s));
  const yellow_s = Math.max(0, ...phases.map((phase) => phase.yellow_s));
  return { yellow_s, red_clear_s: total - yellow_s };
}

/** A stage's split: its green and all that follows before the next one's. */
export function splitOf(stage) {
  const { yellow_s, red_clear_s } = changeOf(stage.groups);
  return (stage.green_s || 0) + yellow_s + red_clear_s + RESERVE_S + (stage.extra_red_s || 0);
}

export const cycleOf = (stages) => stages.reduce((sum, stage) => sum + splitOf(stage), 0);

export function PlanStrip({ stages, tall = false }) {
  const words = stages
    .map((stage) => `${stage.groups.map(plain).join(" and ")} green ${secs(stage.green_s || 0)}`)
    .join(", then ");
  return html`
    <div class="strip" data-tall=${tall} role="img" aria-label=${words}>
      ${stages.map((stage, at) => {
        const { yellow_s } = changeOf(stage.groups);
        const red_s = splitOf(stage) - (stage.green_s || 0) - yellow_s;
        return html`
          <i key=${`g${at}`} data-sign="green" style=${{ flexGrow: stage.green_s || 0.01 }}>
            ${tall && html`<span>${stage.groups.map(plain).join(" + ")}</span>`}
          </i>
          <i key=${`y${at}`} data-sign="yellow" style=${{ flexGrow: yellow_s }}></i>
          <i key=${`r${at}`} data-sign="clear" style=${{ flexGrow: red_s }}></i>
        `;
      })}
    </div>
  `;
}
