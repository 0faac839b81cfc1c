/** The verdict in a sentence, how much better the simulator got, and what can be downloaded. */
import { useState } from "preact/hooks";
import { moment } from "scm/shared/format.js";
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";
import { change } from "scm/shell/api.js";
import { go } from "scm/shell/router.js";
import { alike, verdictOf, VERDICTS } from "scm/pages/mismatch/words.js";

const FILES = {
  "report.html": "Page to keep or print",
  "report.json": "Fields",
  "car.toml": "Car with what was found",
  "retuned.toml": "Car with its numbers refitted",
  "given.toml": "Car as it was given",
  "windows.csv": "Windows driven",
};

export function Head({ report }) {
  const { row, drawn, job } = report;
  const unable = { kind: "unreadable", sign: VERDICTS.unreadable.sign, word: "No verdict" };
  const verdict = drawn.can_judge ? verdictOf(row) : unable;
  const from = job?.from_s !== null || job?.to_s !== null;
  const part = job && from ? `, ${job.from_s ?? 0} s to ${job.to_s === null ? "its end" : `${job.to_s} s`}` : "";
  return html`
    <section class="panel head" data-verdict=${verdict.kind} aria-label="Verdict">
      <p class="trail"><a href="/mismatch">Mismatch</a> / ${row.name}</p>
      <div class="two">
        <div>
          <p class="verdict"><i aria-hidden="true">${verdict.sign}</i>${verdict.word}</p>
          <h2 class="sentence">${drawn.said}</h2>
          ${drawn.named && html`<p>${drawn.named}</p>`}
          ${drawn.better && html`<p>${drawn.better}</p>`}
          <p class="facts">
            <span>Car ${drawn.vehicle}</span>
            <span>${job?.source ?? drawn.recordings.join(", ")}${part}</span>
            <span>${moment(row.made_ns)}</span>
            <span>searched ${Math.round(row.runtime_s)} s</span>
          </p>
        </div>
        <${Better} report=${report} />
      </div>
      <${Files} report=${report} />
    </section>
  `;
}

/** Position errors on parts that no fit has seen, as bars with the noise of measuring marked. */
function Better({ report: { report, drawn } }) {
  const confirm = report.fit?.confirm;
  const before = confirm?.before.position_m;
  const after = confirm?.after.position_m;
  if (before === undefined || after === undefined || before === null || after === null) return null;
  const noise = confirm.noise_floor.position_m ?? null;
  const rows = [
    ["before", "The simulator as it was", before],
    ["retuned", "Its own numbers refitted, no new physics", drawn.retuned_m],
    ["after", report.effects.length ? "With what was found" : "With its own numbers refitted", after],
  ].filter(([, , value]) => value !== null);
  const said = alike([...rows.map(([, , value]) => value), noise], "m");
  const most = Math.max(...rows.map(([, , value]) => value), noise ?? 0) || 1;
  return html`
    <div class="better">
      <h3>Position error after ${report.fit.horizon_s} s, on unseen parts</h3>
      <ul>
        ${rows.map(
          ([kind, words, value], i) => html`
            <li key=${kind}>
              <span>${words}</span>
              <span class="track">
                <span class="bar" data-side=${kind} style=${{ width: `${(100 * value) / most}%` }}></span>
                ${noise !== null && html`<i style=${{ left: `${(100 * noise) / most}%` }}></i>`}
              </span>
              <b>${said[i]}</b>
            </li>
          `,
        )}
      </ul>
      ${noise !== null && html`<p class="hint">Line: noise of measuring alone, ${said.at(-1)}</p>`}
    </div>
  `;
}

/** What can be taken home, and the way to be rid of it all. */
export function Files({ report }) {
  const [removing, setRemoving] = useState(false);
  const address = (file) => `/api/v1/mismatch/reports/${report.row.name}/files/${file}`;
  const shown = report.files.filter((file) => FILES[file]);
  return html`
    <div class="files" role="group" aria-label="Files">
      ${shown.map(
        (file) => html`<a key=${file} class="button" href=${address(file)} download>${FILES[file]} <small>${file}</small></a>`,
      )}
      <button class="small plain" onClick=${() => setRemoving(true)}>Remove this report</button>
      ${removing && html`<${Remove} name=${report.row.name} onClose=${() => setRemoving(false)} />`}
    </div>
  `;
}

function Remove({ name, onClose }) {
  const remove = async () => {
    const gone = await change("DELETE", `/mismatch/reports/${name}`, undefined, () => `${name} is removed.`);
    if (gone) go("/mismatch", { replace: true });
    else onClose();
  };
  return html`
    <${Dialog} title="Remove ${name}?" onClose=${onClose}>
      <p>The report, its car files and the drives recorded for it are deleted. The recording stays.</p>
      <div class="actions">
        <button data-first onClick=${onClose}>Keep it</button>
        <button class="danger" onClick=${remove}>Remove</button>
      </div>
    <//>
  `;
}
