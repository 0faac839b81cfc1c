/** Step 3: what was found and kept: look, download, put in force, throw away. */
import { useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { clock, fixed } from "scm/shared/format.js";
import { Dialog } from "scm/shared/dialog.js";
import { read } from "scm/pages/eye/asking.js";
import { change } from "scm/shell/api.js";

export function Shelf({ kept, known, changed }) {
  const [open, setOpen] = useState(null);
  return html`
    <section class="panel eye-shelf" aria-label="Calibrations">
      <div class="panel-head"><h2><b class="step">3</b> Use <small>what was found and kept</small></h2></div>
      ${kept.length
        ? html`
            <div class="scroll" tabindex="0" role="region" aria-label="Table of calibrations">
              <table>
                <thead>
                  <tr>
                    <th scope="col">Name</th><th scope="col">Kind</th><th scope="col">Made</th>
                    <th scope="col" class="number">Frame</th><th scope="col" class="number">Left</th><th scope="col"></th>
                  </tr>
                </thead>
                <tbody>${kept.map((one) => html`<${Row} key=${one.name} one=${one} open=${setOpen} changed=${changed} />`)}</tbody>
              </table>
            </div>
          `
        : html`<p class="empty">${known ? "Nothing is kept yet: measure a lens or find a place." : "Reads the shelf …"}</p>`}
      <div class="note">
        The running Eye reads calibrations when it starts. A lens: <code>scm eye MAP --calibration NAME.toml</code>. A
        place: its block takes the one of the same name in the map file. Then start the city anew.
      </div>
      ${open && html`<${Text} file=${open} close=${() => setOpen(null)} />`}
    </section>
  `;
}

function Row({ one, open, changed }) {
  const path = `/eye/calibrations/${one.name}`;
  const remove = async () => {
    const tag = await fetch(`/api/v1${path}`).then((response) => response.headers.get("ETag"));
    await change("DELETE", path, undefined, () => `${one.name} is gone.`, { "If-Match": tag ?? "*" });
    changed();
  };
  return html`
    <tr>
      <td><button class="name" title="Show the file" onClick=${async () => open(await read(path).catch(() => null))}>${one.name}</button></td>
      <td>${one.kind}</td>
      <td>${clock(one.made_ns)}</td>
      <td class="number">${`${one.width_px} × ${one.height_px}`}</td>
      <td class="number">${one.rms_px === null ? "—" : fixed(one.rms_px, 3, " px")}</td>
      <td>
        <a href=${`/api/v1${path}/file.toml`} download=${`${one.name}.toml`}>Download</a>
        <button class="plain" aria-label="Throw ${one.name} away" onClick=${remove}>×</button>
      </td>
    </tr>
  `;
}

function Text({ file, close }) {
  return html`
    <${Dialog} title=${file.row.name} onClose=${close}>
      <pre tabindex="0">${file.toml}</pre>
      <div class="actions"><button class="primary" data-first onClick=${close}>Close</button></div>
    </${Dialog}>
  `;
}
