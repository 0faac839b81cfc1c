/** The recordings page. */
import { html } from "scm/shared/html.js";

export function Page() {
  return html`<section class="panel" aria-label="Recordings"></section>`;
}
