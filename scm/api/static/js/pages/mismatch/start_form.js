/** Start a search: of a run of this city, or of a recording of one's own that is sent first. */
import { useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { searchBody, question, SearchFields } from "scm/shared/search_fields.js";
import { change, notify } from "scm/shell/api.js";
import { useFetched } from "scm/shared/fetched.js";
import { zipOf } from "scm/pages/mismatch/zip.js";

const KNOWN = /\.(ya?ml|csv|csv\.gz|npz|mat|parquet|bag|db3|mcap)$/i;

export function StartForm({ onStarted }) {
  const offers = useFetched("/mismatch/offers").body;
  const [from, setFrom] = useState("city");
  const [wanted, setWanted] = useState(question());
  const [busy, setBusy] = useState("");
  const start = async (event) => {
    event.preventDefault();
    const form = new FormData(event.target);
    const body = searchBody(wanted);
    if (from === "own") {
      setBusy("Sending …");
      const upload = await send(form, offers.most_upload_bytes).finally(() => setBusy(""));
      if (!upload) return;
      body.upload = upload;
    } else {
      body.recording = form.get("recording");
    }
    const done = () => "The search has begun.";
    if (await change("POST", "/mismatch/jobs", body, done)) onStarted();
  };
  return html`
    <section class="panel start" aria-label="Start a search">
      <div class="panel-head"><h2>Start a search</h2></div>
      ${!offers
        ? html`<p class="empty">Looking what there is …</p>`
        : html`
            <form onSubmit=${start}>
              <div class="tabs" role="group" aria-label="Recording from">
                <button type="button" class="small" aria-pressed=${from === "city"} onClick=${() => setFrom("city")}>
                  Run of this city
                </button>
                <button type="button" class="small" aria-pressed=${from === "own"} onClick=${() => setFrom("own")}>
                  My own recording
                </button>
              </div>
              ${from === "city" ? html`<${OfCity} names=${offers.recordings} />` : html`<${OfOwn} />`}
              <div class="fields">
                <${SearchFields} value=${wanted} onChange=${setWanted} files=${offers.cars} />
              </div>
              <button class="primary" disabled=${Boolean(busy) || (from === "city" && !offers.recordings.length)}>
                ${busy || "Search"}
              </button>
            </form>
          `}
    </section>
  `;
}

function OfCity({ names }) {
  if (!names.length) return html`<p class="empty">This city has recorded nothing yet.</p>`;
  return html`
    <label>
      Recording
      <select name="recording">${names.map((name) => html`<option key=${name}>${name}</option>`)}</select>
    </label>
  `;
}

function OfOwn() {
  return html`
    <label>
      Folder of the recording
      <input name="folder" type="file" webkitdirectory multiple />
    </label>
    <label>
      or one file, .zip or .mcap
      <input name="file" type="file" accept=".zip,.mcap" />
    </label>
    <p class="hint">
      Tables of commands and poses, and beside them a <code>recording.yaml</code> that describes their columns.
    </p>
  `;
}

/** @returns the id of what was sent; null when there is nothing to send, or it was refused. */
async function send(form, most) {
  const one = form.get("file");
  const folder = form.getAll("folder").filter((file) => file.size && KNOWN.test(file.name));
  if (!one?.size && !folder.length) {
    notify("error", "Choose the folder of a recording, or a .zip or .mcap file.");
    return null;
  }
  const name = one?.size ? one.name : folder[0].webkitRelativePath.split("/")[0];
  const blob = one?.size ? await packed([one]) : await packed(folder);
  if (blob.size > most) {
    notify("error", `The recording is ${Math.ceil(blob.size / 2 ** 20)} MiB, at most ${most / 2 ** 20} MiB are accepted.`);
    return null;
  }
  const stem = encodeURIComponent(name.replace(/\.(zip|mcap)$/i, "").slice(0, 100));
  const reply = await change("POST", `/mismatch/uploads?name=${stem}`, blob);
  return reply?.upload ?? null;
}

async function packed(files) {
  if (files.length === 1 && /\.zip$/i.test(files[0].name)) {
    return new Blob([files[0]], { type: "application/zip" });
  }
  const read = async (file) => ({
    name: file.webkitRelativePath || file.name,
    bytes: new Uint8Array(await file.arrayBuffer()),
  });
  return zipOf(await Promise.all(files.map(read)));
}
