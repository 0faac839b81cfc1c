/** A plan's cycle as a strip: each stage's green, yellow and red clear, as wide as they last. */
import { html } from "scm/shared/html.js";
import { site } from "scm/pages/signals/store.js";
import { plain, secs } from "scm/pages/signals/words.js";

/** Three tenths: what the timetable leaves for steps that come late, between two stages. */
const RESERVE_S = 0.3;

/** What the kernel adds after a stage: the longest of its groups. */
export function changeOf(groups) {
  const phases = (site.value?.phases ?? []).filter((phase) => groups.includes(phase.group));
  const total = Math.max(0, ...phases.map((phase) => phase.yellow_s + phase.red_clear_s));
  const yellow = Math.max(0, ...phases.map((phase) => phase.yellow_s));
  return { yellow_s: yellow, red_clear_s: total - yellow + (groups.length ? RESERVE_S : 0) };
}

export function cycleOf(stages) {
  return stages.reduce((sum, stage) => {
    const { yellow_s, red_clear_s } = changeOf(stage.groups);
    return sum + (stage.green_s || 0) + (stage.extra_red_s || 0) + yellow_s + red_clear_s;
  }, 0);
}

export function PlanStrip({ stages, tall = false }) {
  const words = stages
    .map((stage) => `${stage.groups.map(plain).join(" and ")} green ${secs(stage.green_s || 0)}`)
    .join(", then ");
  return html`
    <div class="strip" data-tall=${tall} role="img" aria-label=${words}>
      ${stages.map((stage, at) => {
        const { yellow_s, red_clear_s } = changeOf(stage.groups);
        const red_s = red_clear_s + (stage.extra_red_s || 0);
        return html`
          <i key=${`g${at}`} data-sign="green" style=${{ flexGrow: stage.green_s || 0.01 }}>
            ${tall && stage.groups.map(plain).join(" + ")}
          </i>
          <i key=${`y${at}`} data-sign="yellow" style=${{ flexGrow: yellow_s }}></i>
          <i key=${`r${at}`} data-sign="clear" style=${{ flexGrow: red_s }}></i>
        `;
      })}
    </div>
  `;
}
