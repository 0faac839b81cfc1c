/** What the page has to say: short notices. A dialog that is open shows them, for all behind it is dim and out of reach. */
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
