/** Begin a mismatch job: does this car drive as its file describes? */
import { useEffect, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";
import { searchBody, question, SearchFields } from "scm/shared/search_fields.js";
import { change } from "scm/shell/api.js";
import { go } from "scm/shell/router.js";
import { read } from "scm/shared/fetched.js";

export function MismatchDialog({ recording, cars, player, chosen, onClose }) {
  const names = cars.map((car) => car.vehicle);
  const [wanted, setWanted] = useState(question(names.includes(chosen) ? chosen : (names[0] ?? "")));
  const [files, setFiles] = useState([]);
  useEffect(() => void read("/mismatch/offers").then(({ body }) => setFiles(body.cars), () => {}), []);
  const submit = async (event) => {
    event.preventDefault();
    const body = { recording: recording.name, ...searchBody(wanted) };
    if (await change("POST", "/mismatch/jobs", body, () => "The search has begun.")) {
      onClose();
      go("/mismatch");
    }
  };
  return html`
    <${Dialog} title="Start a search" onClose=${onClose}>
      <p class="hint">Drives the car's file with the recorded commands, and searches for what the two differ in.</p>
      ${!cars.length && html`<p class="form-error">This recording contains no car.</p>`}
      <form class="fields two-by-two" onSubmit=${submit}>
        <${SearchFields}
          value=${wanted}
          onChange=${setWanted}
          cars=${names}
          files=${files}
          most_s=${recording.length_s}
          player=${player}
        />
        <div class="actions">
          <button type="button" onClick=${onClose}>Cancel</button>
          <button class="primary" disabled=${!cars.length}>Search</button>
        </div>
      </form>
    <//>
  `;
}
