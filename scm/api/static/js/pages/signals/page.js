/** The signals page: one junction, chosen in the address, as a traffic engineer looks at it. */
import { useEffect } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { go, route } from "scm/shell/router.js";
import { prose } from "scm/shell/prose.js";
import { city, signals, useTopics } from "scm/shell/store.js";
import { Diagram } from "scm/pages/signals/diagram.js";
import { Heads } from "scm/pages/signals/heads.js";
import { Monitor } from "scm/pages/signals/monitor.js";
import { editing, PlanEditor } from "scm/pages/signals/plan_editor.js";
import { Plans } from "scm/pages/signals/plans.js";
import { GuaranteedTimes } from "scm/pages/signals/guaranteed_times.js";
import { keep, look, row, status, trouble } from "scm/pages/signals/store.js";
import { plain, toCome } from "scm/pages/signals/words.js";
import { Overrides } from "scm/pages/signals/overrides.js";

export function Page() {
  useTopics("signals", "signal_status", "events");
  const names = signals.value.map((one) => one.junction);
  const wanted = route.value.rest || names[0] || null;
  const known = names.includes(wanted);
  useEffect(keep, []);
  useEffect(() => {
    if (known) look(wanted);
  }, [wanted, known]);
  if (!names.length) return html`<${Empty} />`;
  if (!known) return html`<${Unknown} wanted=${wanted} first=${names[0]} />`;
  const current = row();
  if (!current) return null;
  return html`
    <${Bar} current=${current} names=${names} />
    <${Heads} current=${current} />
    <${Diagram} />
    ${editing.value?.junction === current.junction
      ? html`<${PlanEditor} />`
      : html`<${Plans} current=${current} /><${Overrides} current=${current} /><${GuaranteedTimes} />`}
  `;
}

function Empty() {
  const hasNone = city.value && !city.value.lights?.length;
  return html`
    <section class="panel" aria-label="Signals">
      <h2>Signals</h2>
      <p class="empty">${hasNone ? "This city has no signals." : "Waiting for the signals…"}</p>
    </section>
  `;
}

function Unknown({ wanted, first }) {
  return html`
    <section class="panel" role="alert">
      <h2>No junction ${wanted}</h2>
      <p class="empty">This city has none of that name. <a href="/signals/${first}">Go to ${first}</a>.</p>
    </section>
  `;
}

const MODES = {
  start: "starting, all red",
  plan: "fixed time",
  adaptive: "adaptive",
  priority: "priority",
  preempt: "pre-empted",
};

/** How the lights are run; of a flash, what ends it. */
function modeOf({ mode, monitor }) {
  if (mode !== "flash") return MODES[mode] ?? mode;
  return monitor?.fault ? "until the monitor's fault is reset" : "until somebody ends it";
}

/** Which junction, what runs, and the monitor's state: the line that is read first. */
function Bar({ current, names }) {
  const now = status();
  const runs = !current.fresh
    ? "no report"
    : current.mode === "flash"
      ? "flashing red"
      : current.mode === "plan" || now?.policy === "fixed"
        ? `plan ${current.plan}`
        : `policy ${plain(now?.policy ?? current.plan)}`;
  const choose = (event) => go(`/signals/${event.target.value}`);
  return html`
    <section class="panel bar" aria-label="Junction ${current.junction}">
      ${names.length > 1
        ? html`
            <label>
              <span class="hidden">Junction</span>
              <select id="junction" value=${current.junction} onChange=${choose}>
                ${names.map((name) => html`<option key=${name} value=${name}>${plain(name)}</option>`)}
              </select>
            </label>
          `
        : html`<h2>${plain(current.junction)}</h2>`}
      <span class="runs moves" data-mode=${current.fresh ? current.mode : "silent"}>
        <b>${runs}</b>
        <small>${current.fresh ? modeOf(current) : "its controller is silent"}</small>
      </span>
      ${now?.pending &&
      html`<span class="pending" role="status">${toCome(now.pending, current.mode)}</span>`}
      ${now?.failure && html`<span class="failure" role="alert">${now.failure}</span>`}
      ${trouble.value && html`<span class="failure" role="status">${prose(trouble.value)}</span>`}
      <${Monitor} current=${current} />
    </section>
  `;
}
