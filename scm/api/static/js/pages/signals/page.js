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
import { Promises } from "scm/pages/signals/promises.js";
import { keep, look, row, status, trouble } from "scm/pages/signals/store.js";
import { plain, toCome } from "scm/pages/signals/words.js";
import { Wishes } from "scm/pages/signals/wishes.js";

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
  const told = row();
  if (!told) return null;
  return html`
    <${Bar} told=${told} names=${names} />
    <${Heads} told=${told} />
    <${Diagram} />
    ${editing.value?.junction === told.junction
      ? html`<${PlanEditor} />`
      : html`<${Plans} told=${told} /><${Wishes} told=${told} /><${Promises} />`}
  `;
}

function Empty() {
  const said = city.value && !city.value.lights?.length;
  return html`
    <section class="panel" aria-label="Signals">
      <h2>Signals</h2>
      <p class="empty">${said ? "This city has no signals." : "Waiting for the signals…"}</p>
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

/** Which junction, what runs, and what the monitor says: the line that is read first. */
function Bar({ told, names }) {
  const now = status();
  const runs = !told.fresh
    ? "not heard"
    : told.mode === "flash"
      ? "flashing red"
      : told.mode === "plan" || now?.policy === "fixed"
        ? `plan ${told.plan}`
        : `policy ${plain(now?.policy ?? told.plan)}`;
  const choose = (event) => go(`/signals/${event.target.value}`);
  return html`
    <section class="panel bar" aria-label="Junction ${told.junction}">
      ${names.length > 1
        ? html`
            <label>
              <span class="hidden">Junction</span>
              <select id="junction" value=${told.junction} onChange=${choose}>
                ${names.map((name) => html`<option key=${name} value=${name}>${plain(name)}</option>`)}
              </select>
            </label>
          `
        : html`<h2>${plain(told.junction)}</h2>`}
      <span class="runs moves" data-mode=${told.fresh ? told.mode : "unheard"}>
        <b>${runs}</b>
        <small>${told.fresh ? modeOf(told) : "its controller is silent"}</small>
      </span>
      ${now?.pending &&
      html`<span class="pending" role="status">${toCome(now.pending, told.mode)}</span>`}
      ${now?.failure && html`<span class="failure" role="alert">${now.failure}</span>`}
      ${trouble.value && html`<span class="failure" role="status">${prose(trouble.value)}</span>`}
      <${Monitor} told=${told} />
    </section>
  `;
}
