/** The recordings page: what was recorded, any moment of it again, scripts, and studies. */
import { html } from "scm/shared/html.js";
import { route } from "scm/shell/router.js";
import { RecordingsList } from "scm/pages/recordings/list.js";
import { Replay } from "scm/pages/recordings/replay.js";
import { Scenarios } from "scm/pages/recordings/scenarios.js";
import { Studies } from "scm/pages/recordings/studies.js";

export function Page() {
  const { rest } = route.value;
  if (rest === "") return html`<${RecordingsList} />`;
  if (rest === "scenarios") return html`<${Scenarios} />`;
  if (rest === "studies") return html`<${Studies} />`;
  return html`<${Replay} key=${rest} name=${rest} />`;
}
