/** The Eye: `/eye` shows what each camera sees and how true it is, `/eye/calibrate` measures one anew. */
import { html } from "scm/shared/html.js";
import { go, route } from "scm/shell/router.js";
import { cameras, useTopics } from "scm/shell/store.js";
import { InForce } from "scm/pages/eye/in_force.js";
import { Picture } from "scm/pages/eye/picture.js";
import { Residuals } from "scm/pages/eye/residuals.js";
import { TagTable } from "scm/pages/eye/tag_table.js";
import { Tracks } from "scm/pages/eye/tracks.js";
import { Wizard } from "scm/pages/eye/wizard.js";

export function Page() {
  useTopics("eye", "vehicles");
  const list = cameras.value;
  if (!list.length) {
    return html`
      <section class="panel" aria-label="Eye">
        <p class="empty">No camera has reported yet. The Eye is a part of its own: <code>scm eye</code>.</p>
      </section>
    `;
  }
  const { query, rest } = route.value;
  const camera = query.camera ? list.find((one) => one.camera === query.camera) : list[0];
  if (!camera || !["", "calibrate"].includes(rest)) return html`<${NotFound} list=${list} />`;
  return html`
    <${Bar} list=${list} camera=${camera} />
    ${rest === "calibrate"
      ? html`<${Wizard} key=${camera.camera} camera=${camera} />`
      : html`
          <${Picture} key=${camera.camera} camera=${camera} />
          <${TagTable} camera=${camera} />
          <${Tracks} />
          <${Residuals} key=${`${camera.camera} residuals`} camera=${camera} />
        `}
  `;
}

/** What an address is answered that leads to no camera. */
function NotFound({ list }) {
  const requested = route.value.query.camera;
  return html`
    <section class="panel" aria-label="Eye">
      <p class="empty">
        ${requested ? `There is no camera called ${requested}.` : "There is no such page of the Eye."} Cameras of the city:
        ${list.map(({ camera }) => html` <a key=${camera} href=${`/eye?camera=${camera}`}>${camera}</a>`)}
      </p>
    </section>
  `;
}

function Bar({ list, camera }) {
  const calibrates = route.value.rest === "calibrate";
  const at = (name) => `/eye${calibrates ? "/calibrate" : ""}?camera=${name}`;
  return html`
    <div class="bar">
      <label>Camera
        <select value=${camera.camera} onChange=${(event) => go(at(event.currentTarget.value))}>
          ${list.map((one) => html`<option key=${one.camera} value=${one.camera}>${one.camera}</option>`)}
        </select>
      </label>
      <span class="state" data-good=${String(camera.good)}>
        ${camera.good === false ? "do not trust its poses" : camera.good ? "good" : "reports no state"}
      </span>
      <${InForce} camera=${camera} />
      <nav aria-label="Eye">
        <a href=${`/eye?camera=${camera.camera}`} aria-current=${calibrates ? null : "page"}>Live</a>
        <a href=${`/eye/calibrate?camera=${camera.camera}`} aria-current=${calibrates ? "page" : null}>Calibrate</a>
      </nav>
    </div>
  `;
}
