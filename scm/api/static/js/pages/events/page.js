/** The events page: what happened, and in its second tab who changed what. */
import { html } from "scm/shared/html.js";
import { route } from "scm/shell/router.js";
import { AuditTrail } from "scm/pages/events/audit_trail.js";
import { EventLog } from "scm/pages/events/event_log.js";

const TABS = [
  ["", "/events", "Events"],
  ["audit", "/events/audit", "Audit"],
];

export function Page() {
  const { rest } = route.value;
  return html`
    <section class="panel log" aria-label=${rest === "audit" ? "Audit" : "Events"}>
      <nav class="tabs" aria-label="Kinds of log">
        ${TABS.map(
          ([name, path, title]) => html`
            <a key=${name} href=${path} aria-current=${rest === name ? "page" : null}>${title}</a>
          `,
        )}
      </nav>
      ${rest === "audit" ? html`<${AuditTrail} />` : html`<${EventLog} />`}
    </section>
  `;
}
