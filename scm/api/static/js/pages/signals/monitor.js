/** What the monitor sees of the signals, what it reported before, and its reset with a reason. */
import { signal } from "@preact/signals";
import { html } from "scm/shared/html.js";
import { change } from "scm/shell/api.js";
import { prose } from "scm/shell/prose.js";
import { Dialog } from "scm/shared/dialog.js";
import { clock } from "scm/shared/format.js";
import { verdicts } from "scm/pages/signals/store.js";

const SILENT_S = 2;
const open = signal(null);

export function Monitor({ current }) {
  const monitor = current.monitor;
  const state = !monitor
    ? "unknown"
    : monitor.fault
      ? "fault"
      : monitor.age_s > SILENT_S
        ? "stale"
        : "ok";
  const words = {
    unknown: "No report from the monitor",
    stale: `Monitor silent for ${Math.round(monitor?.age_s ?? 0)} s`,
    ok: "Monitor sees no fault",
    fault: `Fault: ${(monitor?.fault ?? "").replaceAll("_", " ")}`,
  };
  return html`
    <div class="monitor" data-state=${state} role="status">
      <i></i>
      <span><b>${words[state]}</b>${monitor?.detail ? html` <small>${prose(monitor.detail)}</small>` : ""}</span>
      <button class="small" onClick=${() => (open.value = "history")}>History</button>
      ${state === "fault" &&
      html`<button class="small danger" onClick=${() => (open.value = "reset")}>Reset…</button>`}
    </div>
    ${open.value === "reset" && html`<${Reset} junction=${current.junction} />`}
    ${open.value === "history" && html`<${History} />`}
  `;
}

const close = () => (open.value = null);

function History() {
  return html`
    <${Dialog} title="Reports of the monitor" onClose=${close}>
      <p>
        Another process watches every colour with a card of its own. A fault makes the junction flash
        red until a person resets it; an overload of this computer ends by itself.
      </p>
      <ul class="history">
        ${verdicts.value.map(
          (one) => html`
            <li key=${one.t_ns}>
              <time>${clock(one.t_ns)}</time>
              <b>${one.fault ? one.fault.replaceAll("_", " ") : "no fault"}</b>
              <small>${prose(one.detail)}</small>
            </li>
          `,
        )}
        ${!verdicts.value.length && html`<li class="empty">No report yet.</li>`}
      </ul>
      <div class="actions"><button data-first onClick=${close}>Close</button></div>
    <//>
  `;
}

function Reset({ junction }) {
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
        <input name="reason" required maxlength="200" placeholder="Reason (needed)" aria-label="Reason" />
        <div class="actions">
          <button type="button" onClick=${close}>Cancel</button>
          <button class="primary">Clear the fault</button>
        </div>
      </form>
    <//>
  `;
}
