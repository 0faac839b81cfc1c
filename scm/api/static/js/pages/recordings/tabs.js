/** The parts of the page: recordings, the scripts that make them, and studies of many runs. */
import { html } from "scm/shared/html.js";

export function Tabs({ here }) {
  const tab = (name, path, title) =>
    html`<a href=${path} aria-current=${here === name ? "page" : null}>${title}</a>`;
  return html`
    <nav class="tabs" aria-label="Recordings, scenarios and studies">
      ${tab("recordings", "/recordings", "Recordings")}
      ${tab("scenarios", "/recordings/scenarios", "Scenarios")}
      ${tab("studies", "/recordings/studies", "Studies")}
    </nav>
  `;
}
