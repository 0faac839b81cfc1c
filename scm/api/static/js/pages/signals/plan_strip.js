/**
 * A plan's cycle as a strip: each stage's green, yellow and red clear, as wide as they last. Between two
 * stages that both have a phase green runs on below the others' yellow and red clear.
 */
import { html } from "scm/shared/html.js";
import { site } from "scm/pages/signals/store.js";
import { plain, secs } from "scm/pages/signals/words.js";

/** What the timetable leaves between two stages for steps that come late. */
const RESERVE_S = 0.3;

/** @returns the groups of a stage that stay green into the next one, or from the last into the first. */
export function goingOn(stages, at) {
  const next = stages[(at + 1) % stages.length].groups;
  return stages[at].groups.filter((group) => next.includes(group));
}

/**
 * What the kernel adds after a stage, by the slowest of the groups that leave it; nothing where none does.
 * After the last stage room is left for all: another plan may follow.
 */
export function changeOf(stages, at) {
  const stay = at + 1 < stages.length ? goingOn(stages, at) : [];
  const leave = stages[at].groups.filter((group) => !stay.includes(group));
  const phases = (site.value?.phases ?? []).filter((phase) => leave.includes(phase.group));
  const total = Math.max(0, ...phases.map((phase) => phase.yellow_s + phase.red_clear_s));
  const yellow_s = Math.max(0, ...phases.map((phase) => phase.yellow_s));
  return { yellow_s, red_clear_s: total - yellow_s, reserve_s: phases.length ? RESERVE_S : 0 };
}

/** A stage's split: its green and all that follows before the next one's. */
export function splitOf(stages, at) {
  const { yellow_s, red_clear_s, reserve_s } = changeOf(stages, at);
  return (stages[at].green_s || 0) + yellow_s + red_clear_s + reserve_s + (stages[at].extra_red_s || 0);
}

export const cycleOf = (stages) => stages.reduce((sum, _, at) => sum + splitOf(stages, at), 0);

/** One stage in words: who is green, how long, and who stays so. */
function inWords(stages, at) {
  const stay = goingOn(stages, at).map(plain);
  const on = stay.length ? `, ${stay.join(" and ")} on into the next` : "";
  return `${stages[at].groups.map(plain).join(" and ")} green ${secs(stages[at].green_s || 0)}${on}`;
}

export function PlanStrip({ stages, tall = false }) {
  const words = stages.map((_, at) => inWords(stages, at)).join(", then ");
  return html`
    <div class="strip" data-tall=${tall} role="img" aria-label=${words}>
      ${stages.map((stage, at) => {
        const { yellow_s } = changeOf(stages, at);
        const red_s = splitOf(stages, at) - (stage.green_s || 0) - yellow_s;
        const on = goingOn(stages, at).length > 0;
        return html`
          <i key=${`g${at}`} data-sign="green" style=${{ flexGrow: stage.green_s || 0.01 }}>
            ${tall && html`<span>${stage.groups.map(plain).join(" + ")}</span>`}
          </i>
          <i key=${`y${at}`} data-sign="yellow" data-on=${on} style=${{ flexGrow: yellow_s }}></i>
          <i key=${`r${at}`} data-sign="clear" data-on=${on} style=${{ flexGrow: red_s }}></i>
        `;
      })}
    </div>
  `;
}
