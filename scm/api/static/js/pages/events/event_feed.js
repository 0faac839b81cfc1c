/** The log of the city, newest first. */
import { html } from "scm/shared/html.js";
import { clock } from "scm/shared/format.js";
import { events } from "scm/shell/store.js";

export function EventFeed() {
  return html`
    <section class="panel events" aria-label="Events">
      <div class="panel-head"><h2>Events</h2></div>
      <div class="scroll" tabindex="0" role="log" aria-label="Log of events, newest first">
        <ol>
          ${events.value.map(
            (event) => html`
              <li key=${event.seq} data-severity=${event.severity}>
                <time>${clock(event.t_ns)}</time>
                <span>${event.text} <small>${event.source}</small></span>
              </li>
            `,
          )}
        </ol>
        ${!events.value.length && html`<p class="empty">Nothing has happened yet.</p>`}
      </div>
    </section>
  `;
}
