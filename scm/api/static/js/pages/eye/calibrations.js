/** Step 3: saved calibrations: view, download, put in force, delete. */
import { useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { clock, fixed } from "scm/shared/format.js";
import { Dialog } from "scm/shared/dialog.js";
import { Sure } from "scm/shared/sure.js";
import { readBody } from "scm/shared/fetched.js";
import { named } from "scm/pages/eye/in_force.js";
import { change } from "scm/shell/api.js";
import { placed } from "scm/shared/base.js";

export function Calibrations({ camera, saved, known, changed, put }) {
  const [open, setOpen] = useState(null);
  const [removing, setRemoving] = useState(null); // to be deleted
  return html`
    <section class="panel eye-calibrations" aria-label="Calibrations">
      <div class="panel-head">
        <h2><b class="step">3</b> Use <small>saved calibrations</small></h2>
        ${camera.in_force?.before &&
        html`<button class="small" title=${named(camera.in_force.before)} onClick=${() => put(null)}>Put back…</button>`}
      </div>
      ${saved.length
        ? html`
            <div class="scroll" tabindex="0" role="region" aria-label="Table of calibrations">
              <table>
                <thead class="hidden"><tr><th scope="col">Calibration</th><th scope="col">What to do with it</th></tr></thead>
                <tbody>${saved.map((one) => html`<${Row} key=${one.name} camera=${camera} one=${one} open=${setOpen} discard=${setRemoving} put=${put} />`)}</tbody>
              </table>
            </div>
          `
        : html`<p class="empty">${known ? "Nothing saved yet: measure a lens or find a place." : "Reading …"}</p>`}
      <div class="note">
        A calibration in force stays until another one is put in force; after a restart too, if the city stores its state. Permanently: a
        lens by <code>scm eye MAP --calibration NAME.toml</code>, a place by its block in the map file.
      </div>
      ${removing &&
      html`
        <${Sure} title="Throw ${removing.name} away?" yes="Throw away" act=${() => remove(removing).then(changed)} onClose=${() => setRemoving(null)}>
          The calibration and how it was found are deleted for everybody.
          ${isInForce(camera, removing) && " The camera continues to use it until another one is put in force."}
        <//>
      `}
      ${open && html`<${Text} file=${open} close=${() => setOpen(null)} />`}
    </section>
  `;
}

const isInForce = (camera, one) => camera.in_force?.now[one.kind] === one.name;

async function remove({ name }) {
  const path = `/eye/calibrations/${name}`;
  const tag = await fetch(placed(`/api/v1${path}`)).then((response) => response.headers.get("ETag"));
  await change("DELETE", path, undefined, () => `${name} is gone.`, { "If-Match": tag ?? "*" });
}

function Row({ camera, one, open, discard, put }) {
  const fits = one.kind === "lens" ? one.width_px === camera.width_px && one.height_px === camera.height_px : one.camera === camera.camera;
  const path = `/eye/calibrations/${one.name}`;
  return html`
    <tr>
      <td>
        <button class="name" title="Show the file" onClick=${async () => open(await readBody(path).catch(() => null))}>${one.name}</button>
        <small>${factsOf(one, fits)}</small>
      </td>
      <td>
        ${isInForce(camera, one)
          ? html`<span class="good">in force</span>`
          : fits && html`<button class="small" aria-label="Put ${one.name} in force" onClick=${() => put(one.name)}>Put in force…</button>`}
        <a href=${`/api/v1${path}/file.toml`} download=${`${one.name}.toml`}>Download</a>
        <button class="plain" aria-label="Throw ${one.name} away" onClick=${() => discard(one)}>×</button>
      </td>
    </tr>
  `;
}

function factsOf(one, fits) {
  const kind = one.kind === "place" && !fits ? `place of ${one.camera}` : one.kind;
  const left = one.rms_px === null ? [] : [`${fixed(one.rms_px, 3)} px left`];
  return [kind, `made ${clock(one.made_ns)}`, `${one.width_px} × ${one.height_px} px`, ...left].join(" · ");
}

function Text({ file, close }) {
  return html`
    <${Dialog} title=${file.row.name} onClose=${close}>
      <pre tabindex="0">${file.toml}</pre>
      <div class="actions"><button class="primary" data-first onClick=${close}>Close</button></div>
    </${Dialog}>
  `;
}
