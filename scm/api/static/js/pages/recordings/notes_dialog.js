/** What to call a recording, what to know of it; and its end. */
import { useEffect, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";
import { change } from "scm/shell/api.js";
import { go } from "scm/shell/router.js";
import { read } from "scm/shared/fetched.js";
import { size } from "scm/pages/recordings/words.js";

export function NotesDialog({ recording, onClose, onChanged }) {
  const path = `/recordings/${encodeURIComponent(recording.name)}/notes`;
  const [known, setKnown] = useState(null);
  useEffect(() => void read(path).then(setKnown, () => onClose()), [path]);
  const submit = async (event) => {
    event.preventDefault();
    const { title, notes } = event.target.elements;
    const body = { title: title.value, notes: notes.value };
    const done = () => "Noted.";
    if (await change("PUT", path, body, done, { "If-Match": known.etag })) {
      onChanged();
      onClose();
    }
  };
  if (!known) return null;
  return html`
    <${Dialog} title="Name and notes" onClose=${onClose}>
      <form class="fields" onSubmit=${submit}>
        <label>Name <input name="title" maxlength="120" defaultValue=${known.body.title} placeholder=${recording.name} data-first /></label>
        <label>Notes <textarea name="notes" rows="5" maxlength="4000">${known.body.notes}</textarea></label>
        <p class="hint">The file keeps its name, ${recording.name}.mcap.</p>
        <div class="actions">
          <button type="button" onClick=${onClose}>Cancel</button>
          <button class="primary">Save</button>
        </div>
      </form>
    <//>
  `;
}

export function DeleteDialog({ recording, onClose }) {
  const remove = async () => {
    const path = `/recordings/${encodeURIComponent(recording.name)}`;
    const reply = await change("DELETE", path, undefined, () => `${recording.name} is deleted.`);
    onClose();
    if (reply) go("/recordings", { replace: true });
  };
  return html`
    <${Dialog} title="Delete this recording?" onClose=${onClose}>
      <p>
        ${recording.title || recording.name}, ${size(recording.size_bytes)}, is deleted from the disk
        for everybody, with its notes. There is no way back.
      </p>
      <div class="actions">
        <button onClick=${onClose} data-first>Keep it</button>
        <button class="danger" onClick=${remove}>Delete it</button>
      </div>
    <//>
  `;
}
