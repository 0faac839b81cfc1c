/** The two halves of the page: recordings, and the scripts that make them. */
import { html } from "scm/shared/html.js";

export function Halves({ here }) {
  const half = (name, path, title) =>
    html`<a href=${path} aria-current=${here === name ? "page" : null}>${title}</a>`;
  return html`
    <nav class="halves" aria-label="Recordings and scenarios">
      ${half("recordings", "/recordings", "Recordings")}
      ${half("scenarios", "/recordings/scenarios", "Scenarios")}
    </nav>
  `;
}
