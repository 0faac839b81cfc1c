/** Every junction in a line: its plan, each group's colour, letter and time to change, and what is wrong. */
import { html } from "scm/shared/html.js";
import { spaced } from "scm/shared/format.js";
import { LETTERS } from "scm/shared/light_shape.js";
import { now, signals, signalsAt } from "scm/shell/store.js";
import { timeToChange } from "scm/pages/map/signal_times.js";

const KNOWN_S = 1.5; // as on the map
const WORDS = { red: "red", yellow: "yellow", green: "green", flashing_red: "flashing red", dark: "dark" };

export function SignalsShort() {
  const passed_s = Math.max(0, (now.value - signalsAt.value) / 1000);
  const rows = passed_s < KNOWN_S ? signals.value : signals.value.map(unknown);
  return html`
    <section class="panel signals-short" aria-label="Signals">
      <div class="panel-head"><h2>Signals <small>${signals.value.length || ""}</small></h2></div>
      <div class="scroll moves" tabindex="0" role="region" aria-label="Signals by junction">
        ${rows.map((junction) => html`<${Junction} key=${junction.junction} junction=${junction} passed_s=${passed_s} />`)}
        ${signals.value.length === 0 && signalsAt.value > 0 && html`<p class="empty">This city has no signals.</p>`}
      </div>
    </section>
  `;
}

/** A junction that no longer reports. */
function unknown(junction) {
  const groups = junction.groups.map(({ group }) => ({ group, colour: null, min_s: null }));
  return { ...junction, fresh: false, groups };
}

function Junction({ junction, passed_s }) {
  const { junction: name, fresh, mode, plan, monitor } = junction;
  const kind = mode === "plan" || mode === "start" ? "plan" : "policy";
  const state = !fresh ? "silent" : mode === "flash" ? "flashing" : `${kind} ${plan.replaceAll("_", " ")}`;
  return html`
    <div class="junction" data-fault=${Boolean(monitor?.fault)}>
      <a href="/signals/${name}">${name}</a>
      <small class=${fresh && mode !== "flash" ? "" : "warn"}>${monitor?.fault ? `monitor: ${monitor.fault}` : state}</small>
      <ul>
        ${junction.groups.map((group) => html`<${Group} key=${group.group} group=${group} passed_s=${passed_s} />`)}
      </ul>
    </div>
  `;
}

function Group({ group, passed_s }) {
  const colour = group.colour ?? "unknown";
  const time = timeToChange(group, passed_s);
  return html`
    <li title="${spaced(group.group)}: ${WORDS[colour] ?? "not known"}">
      <span class="head" data-colour=${colour} role="img" aria-label="${spaced(group.group)} ${WORDS[colour] ?? "not known"}">
        <i></i><b>${LETTERS[colour] ?? "?"}</b>
      </span>
      <span class="words">
        <span class="group">${spaced(group.group)}</span>
        <span class="time">${time || "—"}</span>
      </span>
    </li>
  `;
}
