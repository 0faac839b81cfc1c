/** The events page. */
import { html } from "scm/shared/html.js";
import { useTopics } from "scm/shell/store.js";
import { EventFeed } from "scm/pages/events/event_feed.js";

export function Page() {
  useTopics("events");
  return html`<${EventFeed} />`;
}
