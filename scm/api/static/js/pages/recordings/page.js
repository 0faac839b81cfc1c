/** The recordings page: what was recorded, any moment of it again, and the scripts that make runs. */
import { html } from "scm/shared/html.js";
import { route } from "scm/shell/router.js";
import { RecordingsList } from "scm/pages/recordings/list.js";
import { Replay } from "scm/pages/recordings/replay.js";
import { Scenarios } from "scm/pages/recordings/scenarios.js";

export function Page() {
  const { rest } = route.value;
  if (rest === "") return html`<${RecordingsList} />`;
  if (rest === "scenarios") return html`<${Scenarios} />`;
  return html`<${Replay} key=${rest} name=${rest} />`;
}
