/** A question before something is deleted that nobody can bring back. */
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";

/** @param yes the label of the confirming button; @param act what it does */
export function Sure({ title, yes, act, onClose, children }) {
  const agree = () => {
    onClose();
    act();
  };
  return html`
    <${Dialog} title=${title} onClose=${onClose}>
      <p>${children}</p>
      <div class="actions">
        <button data-first onClick=${onClose}>Keep it</button>
        <button class="danger" onClick=${agree}>${yes}</button>
      </div>
    <//>
  `;
}
