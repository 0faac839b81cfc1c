/** By which calibration the camera sees, and the question before another one is put in force. */
import { useEffect, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { clock } from "scm/shared/format.js";
import { Dialog } from "scm/shared/dialog.js";
import { read } from "scm/pages/eye/asking.js";
import { change, notify } from "scm/shell/api.js";

/** `{lens, place}` as people say it. */
export function named({ lens, place }) {
  return [place && `place ${place}`, lens && `lens ${lens}`].filter(Boolean).join(", ") || "as started";
}

export function InForce({ camera }) {
  const told = camera.in_force;
  if (!told) return null;
  const since = told.since_ns === null ? "" : `since ${clock(told.since_ns)} by ${told.by}`;
  return html`
    <span class="in-force" title=${told.reason || "By the map file, and the lens it was started with"}>
      Calibration <b>${named(told.now)}</b> ${since}
    </span>
  `;
}

/** Ask for a reason, then put `wish` in force: the name of a calibration, or null for what was before. */
export function PutInForce({ camera, wish, close }) {
  const report = useReport(wish);
  const [unsure, setUnsure] = useState(""); // why the Eye would flag its poses
  const late = wish === null && !camera.in_force?.before;
  useEffect(() => {
    if (!late) return;
    close();
    notify("info", `${camera.camera} was put back meanwhile.`);
  }, [late]);
  if (late) return null;
  const what = wish ?? named(camera.in_force.before);
  const submit = async (event) => {
    event.preventDefault();
    const body = { by: "dashboard", reason: event.target.elements.reason.value };
    const path = `/eye/cameras/${camera.camera}/calibration`;
    if (wish) {
      const asked = { ...body, calibration: wish, accept_unsure: Boolean(unsure) };
      let again = false;
      await change("PUT", path, asked, said, {}, null, { unsure: (why) => setUnsure(((again = true), why)) });
      if (again) return;
    } else await change("POST", `${path}/back`, body, said);
    close();
  };
  const said = (reply) => `${camera.camera} sees by: ${named(reply.in_force.now)}.`;
  return html`
    <${Dialog} title=${wish ? `Put ${what} in force?` : `Put back: ${what}?`} onClose=${close}>
      <p>
        ${wish
          ? "The Eye sees by it from its next frame on, if the map tags in view agree with it. What is in force now can be put back."
          : "The Eye sees by it from its next frame on, and says so if the map tags no longer agree with it."}
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
          <button class=${unsure ? "danger" : "primary"}>${unsure ? "Put in force although unsure" : wish ? "Put in force" : "Put back"}</button>
        </div>
      </form>
    <//>
  `;
}

/** How a calibration was found; null: nobody wrote it down. */
function useReport(name) {
  const [report, setReport] = useState(null);
  useEffect(() => {
    if (name) read(`/eye/calibrations/${name}`).then(({ row }) => row.reported && read(`/eye/calibrations/${name}/report`).then(setReport)).catch(() => null);
  }, [name]);
  return report;
}
