/** The Eye page. */
import { html } from "scm/shared/html.js";
import { useTopics } from "scm/shell/store.js";
import { EyePanel } from "scm/pages/eye/eye_panel.js";

export function Page() {
  useTopics("eye", "vehicles");
  return html`<${EyePanel} />`;
}
