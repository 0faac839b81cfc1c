/** The verdict in a word, what the report is of, and what can be downloaded. */
import { useState } from "preact/hooks";
import { moment } from "scm/shared/format.js";
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";
import { change } from "scm/shell/api.js";
import { go } from "scm/shell/router.js";
import { verdictOf, VERDICTS } from "scm/pages/mismatch/words.js";

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
  const verdict = drawn?.can_judge ? verdictOf(row) : unable;
  const from = job?.from_s !== null || job?.to_s !== null;
  const part = job && from ? `, ${job.from_s ?? 0} s to ${job.to_s === null ? "its end" : `${job.to_s} s`}` : "";
  return html`
    <section class="panel head" data-verdict=${verdict.kind} aria-label="Verdict">
      <p class="trail"><a href="/mismatch">Mismatch</a> / ${row.name}</p>
      <p class="verdict"><i aria-hidden="true">${verdict.sign}</i>${verdict.word}</p>
      <p class="facts">
        <span>Car ${row.vehicle}</span>
        <span>${row.source}${part}</span>
        <span>${moment(row.made_ns)}</span>
        <span>searched ${Math.round(row.runtime_s)} s</span>
      </p>
      <${Files} report=${report} />
    </section>
  `;
}

/** What can be downloaded, and the way to remove it all. */
function Files({ report }) {
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
