/** The calibration in force, and the dialog before another one is put in force. */
import { useEffect, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { clock } from "scm/shared/format.js";
import { Dialog } from "scm/shared/dialog.js";
import { readBody } from "scm/shared/fetched.js";
import { change, notify } from "scm/shell/api.js";

/** `{lens, place}` in words. */
export function named({ lens, place }) {
  return [place && `place ${place}`, lens && `lens ${lens}`].filter(Boolean).join(", ") || "as started";
}

export function InForce({ camera }) {
  const inForce = camera.in_force;
  if (!inForce) return null;
  const since = inForce.since_ns === null ? "" : `since ${clock(inForce.since_ns)} by ${inForce.by}`;
  return html`
    <span class="in-force" title=${inForce.reason || "By the map file, and the lens it was started with"}>
      Calibration <b>${named(inForce.now)}</b> ${since}
    </span>
  `;
}

/** Ask for a reason, then put `choice` in force: the name of a calibration, or null for what was before. */
export function PutInForce({ camera, choice, close }) {
  const report = useReport(choice);
  const [unsure, setUnsure] = useState(""); // why the Eye would flag its poses
  const late = choice === null && !camera.in_force?.before;
  useEffect(() => {
    if (!late) return;
    close();
    notify("info", `${camera.camera} was put back meanwhile.`);
  }, [late]);
  if (late) return null;
  const what = choice ?? named(camera.in_force.before);
  const submit = async (event) => {
    event.preventDefault();
    const body = { by: "dashboard", reason: event.target.elements.reason.value };
    const path = `/eye/cameras/${camera.camera}/calibration`;
    if (choice) {
      const request = { ...body, calibration: choice, accept_unsure: Boolean(unsure) };
      let again = false;
      await change("PUT", path, request, done, {}, null, { unsure: (why) => setUnsure(((again = true), why)) });
      if (again) return;
    } else await change("POST", `${path}/back`, body, done);
    close();
  };
  const done = (reply) => `${camera.camera} uses: ${named(reply.in_force.now)}.`;
  return html`
    <${Dialog} title=${choice ? `Put ${what} in force?` : `Put back: ${what}?`} onClose=${close}>
      <p>
        ${choice
          ? "The Eye uses it from its next frame on, if the map tags in view agree with it. What is in force now can be put back."
          : "The Eye uses it from its next frame on, and reports it if the map tags no longer agree with it."}
      </p>
      ${report?.is_sure === false && html`<p class="warn">Two places would show its tags alike: it may be the wrong one.</p>`}
      <form onSubmit=${submit}>
        <input name="reason" required maxlength="200" placeholder="Reason (needed)" aria-label="Reason" data-first />
        ${unsure &&
        html`
          <p class="warn" role="alert">${unsure}</p>
          <label>
            To use it all the same, type the camera's name
            <input name="meant" required autocomplete="off" pattern=${camera.camera} placeholder=${camera.camera} />
          </label>
        `}
        <div class="actions">
          <button type="button" onClick=${close}>Cancel</button>
          <button class=${unsure ? "danger" : "primary"}>${unsure ? "Put in force although unsure" : choice ? "Put in force" : "Put back"}</button>
        </div>
      </form>
    <//>
  `;
}

/** How a calibration was found; null: no report was stored. */
function useReport(name) {
  const [report, setReport] = useState(null);
  useEffect(() => {
    if (name) readBody(`/eye/calibrations/${name}`).then(({ row }) => row.reported && readBody(`/eye/calibrations/${name}/report`).then(setReport)).catch(() => null);
  }, [name]);
  return report;
}
