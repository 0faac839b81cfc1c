/** The signals page. */
import { html } from "scm/shared/html.js";
import { useTopics } from "scm/shell/store.js";
import { SignalsPanel } from "scm/pages/signals/signals_panel.js";

export function Page() {
  useTopics("signals");
  return html`<${SignalsPanel} />`;
}
