/** The question for the API key. */
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";
import { keyWanted } from "scm/shell/api.js";

export function KeyDialog() {
  const answer = keyWanted.value;
  if (!answer) return null;
  const submit = (event) => {
    event.preventDefault();
    answer(event.target.elements.key.value.trim());
  };
  return html`
    <${Dialog} title="API key" onClose=${() => answer("")}>
      <p>This city requires an API key. It is stored for this tab.</p>
      <form onSubmit=${submit}>
        <input name="key" type="password" autocomplete="off" required aria-label="API key" />
        <div class="actions">
          <button type="button" onClick=${() => answer("")}>Cancel</button>
          <button class="primary">Use key</button>
        </div>
      </form>
    <//>
  `;
}
