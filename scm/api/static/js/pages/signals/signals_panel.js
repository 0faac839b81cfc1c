/** The signals: each light with colour, letter and time to change; plan and monitor of its junction. */
import { signal } from "@preact/signals";
import { html } from "scm/shared/html.js";
import { change } from "scm/shell/api.js";
import { Dialog } from "scm/shared/dialog.js";
import { UNKNOWN } from "scm/shared/format.js";
import { city, link, now, signals, signalsAt } from "scm/shell/store.js";

export const LETTERS = { red: "R", yellow: "Y", green: "G", flashing_red: "F", dark: "D" };
const WORDS = {
  red: "red",
  yellow: "yellow",
  green: "green",
  flashing_red: "flashing red",
  dark: "dark",
};

/** A promise this narrow is shown as one time: the later one, so that nobody starts early. */
const NARROW_S = 0.5;

const resetting = signal(null);

/** Junction to the plan it was asked for and has not begun: a change waits for a safe moment. */
const awaited = signal({});

export function SignalsPanel() {
  return html`
    <section class="panel signals" aria-label="Signals">
      ${signals.value.map((junction) => html`<${Junction} key=${junction.junction} of=${junction} />`)}
      ${!signals.value.length && html`<h2>Signals</h2><p class="empty">This city has no signals.</p>`}
      ${resetting.value && html`<${ResetDialog} junction=${resetting.value} />`}
    </section>
  `;
}

function Junction({ of: junction }) {
  const lights = (city.value?.lights ?? []).filter((light) => light.junction === junction.junction);
  const groups = Object.fromEntries(junction.groups.map((group) => [group.group, group]));
  return html`
    <div class="junction">
      <div class="panel-head">
        <h2>Signals <small>${junction.junction}</small></h2>
        <${PlanChoice} junction=${junction} />
      </div>
      <div class="lights">
        ${lights.map(
          (light) => html`
            <${Light} key=${light.light_id} id=${light.light_id} group=${groups[light.group]} />
          `,
        )}
      </div>
      <${Monitor} junction=${junction} />
    </div>
  `;
}

function PlanChoice({ junction }) {
  const choose = async (event) => {
    const plan = event.target.value;
    event.target.value = shown;
    const reply = await change(
      "PUT",
      `/signals/${junction.junction}/plan`,
      { plan, by: "dashboard", reason: "chosen on the dashboard" },
      (reply) =>
        reply.pending
          ? `Plan ${reply.pending} begins at the next safe moment.`
          : `Plan ${reply.plan} is in force.`,
    );
    if (reply) awaited.value = { ...awaited.value, [junction.junction]: reply.pending };
  };
  const next = awaited.value[junction.junction];
  const waits = next && junction.mode !== "flash" && next !== junction.plan;
  const shown = junction.mode === "flash" ? "flash" : (junction.plan ?? "");
  return html`
    <label class="plan">
      <span>${waits ? `${next} begins soon` : "Plan"}</span>
      <select value=${shown} onChange=${choose} disabled=${!junction.fresh}>
        ${!shown && html`<option value="">${UNKNOWN}</option>`}
        ${junction.plans.map((plan) => html`<option key=${plan} value=${plan}>${plan}</option>`)}
      </select>
    </label>
  `;
}

function Light({ id, group }) {
  const known = link.value === "live" || link.value === "connecting" ? group?.colour : null;
  const colour = known ?? "unknown";
  const text = `Light ${id}, group ${group?.group}: ${WORDS[known] ?? "unknown"}`;
  return html`
    <div class="light" data-light=${id} data-colour=${colour} aria-label=${text}>
      <span class="lamp" aria-hidden="true">${LETTERS[known] ?? "?"}</span>
      <span class="what"><b>${id}</b> ${group?.group}</span>
      <span class="left">${known ? timeLeft(group) : UNKNOWN}</span>
      <span class="then">${known && group.next_colour ? `then ${WORDS[group.next_colour]}` : ""}</span>
    </div>
  `;
}

/** A promise is shown as given: as one time, as a range, or as "not before". */
function timeLeft({ min_s, max_s }) {
  if (min_s === null) return UNKNOWN;
  const passed = (now.value - signalsAt.value) / 1000;
  const left = (seconds) => Math.max(0, seconds - Math.max(0, passed)).toFixed(1);
  if (max_s === null) return `≥ ${left(min_s)} s`;
  if (max_s - min_s <= NARROW_S) return `${left(max_s)} s`;
  const whole = (text) => (Number(text) < 10 ? text : Math.round(text));
  return `${whole(left(min_s))}–${whole(left(max_s))} s`;
}

function Monitor({ junction }) {
  const monitor = junction.monitor;
  const state = !monitor ? "unknown" : monitor.fault ? "fault" : monitor.age_s > 2 ? "stale" : "ok";
  const words = {
    unknown: "Monitor not heard",
    stale: `Monitor silent for ${Math.round(monitor?.age_s ?? 0)} s`,
    ok: "Monitor sees no fault",
    fault: `Fault: ${(monitor?.fault ?? "").replaceAll("_", " ")}`,
  };
  return html`
    <div class="monitor" data-state=${state} role="status">
      <i></i>
      <span><b>${words[state]}</b>${monitor?.detail ? html` <small>${monitor.detail}</small>` : ""}</span>
      ${state === "fault" &&
      html`<button onClick=${() => (resetting.value = junction.junction)}>Reset…</button>`}
    </div>
  `;
}

function ResetDialog({ junction }) {
  const close = () => (resetting.value = null);
  const submit = (event) => {
    event.preventDefault();
    const reason = event.target.elements.reason.value;
    close();
    change(
      "POST",
      `/signals/${junction}/monitor/reset`,
      { by: "dashboard", reason },
      () => `The fault of ${junction} is cleared.`,
    );
  };
  return html`
    <${Dialog} title="Clear the monitor's fault?" onClose=${close}>
      <p>The lights flash red because the monitor saw them unsafe. Say why that is over.</p>
      <form onSubmit=${submit}>
        <input name="reason" required maxlength="200" placeholder="Reason" aria-label="Reason" />
        <div class="actions">
          <button type="button" onClick=${close}>Cancel</button>
          <button class="primary">Clear the fault</button>
        </div>
      </form>
    <//>
  `;
}
