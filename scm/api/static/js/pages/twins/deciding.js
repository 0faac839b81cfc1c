/** The drive that would decide whose a change is: which car, where, how far it is, and the way to send it. */
import { useState } from "preact/hooks";
import { Dialog } from "scm/shared/dialog.js";
import { html } from "scm/shared/html.js";
import { ago } from "scm/shared/twins.js";
import { change as requestChange } from "scm/shell/api.js";

export function Deciding({ vehicle, change, now_ns, onChanged }) {
  const { drive, decide_by } = change;
  const [isOpen, setOpen] = useState(false);
  if (!decide_by && drive?.state !== "driven") return null;
  const canSend = drive?.state === "open" && drive.vehicle !== "";
  return html`
    <div class="decides" data-drive=${drive?.state}>
      ${decide_by && html`<p><b>To decide whose it is:</b> ${decide_by}</p>`}
      ${drive && drive.state !== "open" && html`<p>${progress(drive, now_ns)}</p>`}
      ${canSend && html`<button class="small" onClick=${() => setOpen(true)}>Send ${drive.vehicle}…</button>`}
      ${isOpen && html`
        <${Send} vehicle=${vehicle} drive=${drive} onClose=${() => setOpen(false)} onChanged=${onChanged} />
      `}
    </div>
  `;
}

/** How far a drive is, in words. */
function progress({ state, vehicle, reason, by, t_ns }, now_ns) {
  const since = html`<small>${ago(t_ns, now_ns)}</small>`;
  if (state === "waiting") return `${vehicle} is sent as soon as it is idle${reason && ` (now: ${reason})`}.`;
  if (state === "under_way") return html`<b>${vehicle} is under way</b>, sent by ${by}, ${since}`;
  if (state === "driven") return html`${vehicle} was sent there by ${by}, and drove, ${since}`;
  return html`${vehicle || "No car"} did not drive there: ${reason}.`;
}

function Send({ vehicle, drive, onClose, onChanged }) {
  const submit = async (event) => {
    event.preventDefault();
    const body = { send: drive.vehicle, by: "dashboard", reason: event.target.elements.reason.value };
    onClose();
    const done = () => `${drive.vehicle} is sent as soon as it is idle.`;
    if (await requestChange("POST", `/twins/${vehicle}/drive`, body, done)) onChanged();
  };
  return html`
    <${Dialog} title="Send ${drive.vehicle} to decide whose ${vehicle}'s change is?" onClose=${onClose}>
      <p>
        As soon as it has no other goal and nobody drives it, it drives
        ${" "}${drive.x_m === null ? "about" : `through (${drive.x_m.toFixed(1)}, ${drive.y_m.toFixed(1)}) some times`},
        for three minutes at most. Then it goes on as before; if it stood, it goes back to its lane.
      </p>
      <form onSubmit=${submit}>
        <input name="reason" maxlength="500" placeholder="Reason (optional)" aria-label="Reason" data-first />
        <div class="actions">
          <button type="button" onClick=${onClose}>Cancel</button>
          <button class="primary">Send ${drive.vehicle}</button>
        </div>
      </form>
    <//>
  `;
}
