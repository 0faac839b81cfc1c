/** Short notices of the page. An open dialog shows them, since everything behind it is out of reach. */
import { coded } from "scm/shared/coded.js";
import { html } from "scm/shared/html.js";
import { dismiss, notices } from "scm/shell/api.js";
import { prose } from "scm/shell/prose.js";

export function Notices() {
  return html`
    <div class="notices" role="status" aria-live="polite">
      ${notices.value.map(
        ({ id, kind, text }) => html`
          <div key=${id} class="notice ${kind}">
            <span>${coded(prose(text))}</span>
            <button class="plain" aria-label="Dismiss" onClick=${() => dismiss(id)}>✕</button>
          </div>
        `,
      )}
    </div>
  `;
}
