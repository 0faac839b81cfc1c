/** The Eye: its newest picture with the tags found drawn over it, and how far off each pose is. */
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { EyePicture } from "scm/pages/eye/eye_picture.js";
import { byName, fixed, span, UNKNOWN } from "scm/shared/format.js";
import { selected } from "scm/shared/selection.js";
import { cameras, live } from "scm/shell/store.js";

const GOOD_MM = 10;

export function EyePanel() {
  const list = cameras.value;
  return html`
    <section class="panel eye" aria-label="Eye">
      ${list.map((camera) => html`<${Camera} key=${camera.camera} of=${camera} />`)}
      ${!list.length &&
      html`<div class="panel-head"><h2>Eye</h2></div><p class="empty">No camera has been heard yet.</p>`}
    </section>
  `;
}

function Camera({ of: camera }) {
  const canvas = useRef(null);
  const picture = useRef(null);
  const [drawn_t_ns, setDrawn] = useState(null);
  const { frame_t_ns, tags } = camera;
  const seen = camera.seen.toSorted((a, b) => byName(a.vehicle, b.vehicle));
  const behind = behind_s(camera, drawn_t_ns);
  useEffect(() => {
    picture.current ??= new EyePicture(camera.camera, canvas.current, setDrawn);
    picture.current.hear(camera);
  }, [frame_t_ns]);
  return html`
    <div class="panel-head">
      <h2>Eye <small>${camera.camera}</small></h2>
      <span class="facts" title="tags found · from exposure to the Eye · how far the picture is behind the map">
        ${`${tags.length} tags · ${fixed(camera.latency_ms, 0, " ms")} · `}
        <span class=${behind > 1 ? "warn" : ""}>${span(behind)}</span>
      </span>
    </div>
    ${camera.complaints.map(
      (said) => html`<p key=${said} class="complaint ${camera.good ? "" : "warn"}" role="status">${said}</p>`,
    )}
    <canvas
      ref=${canvas}
      class="picture"
      width=${camera.width_px ?? 16}
      height=${camera.height_px ?? 9}
      role="img"
      aria-label="Picture of camera ${camera.camera} with ${tags.length} tags found"
      data-frame=${drawn_t_ns}
    ></canvas>
    <ul class="residuals" aria-label="Pose residual against the world's truth">
      ${seen.map((one) => html`<${Seen} key=${one.vehicle} seen=${one} />`)}
    </ul>
  `;
}

/** How much older the drawn picture is than the cars on the map [s]; at least since one was heard. */
function behind_s(camera, drawn_t_ns) {
  const map_t_ns = live.topic?.t_ns ?? null;
  if (drawn_t_ns === null || map_t_ns === null) return camera.age_s;
  return Math.max(camera.age_s, (map_t_ns - Number(drawn_t_ns)) / 1e9);
}

function Seen({ seen }) {
  const residual = seen.residual;
  const good = residual && residual.position_mm <= GOOD_MM;
  return html`
    <li
      class="${selected.value === seen.vehicle ? "chosen" : ""} ${residual && !good ? "warn" : ""}"
      title=${residual ? `yaw ${residual.yaw_deg.toFixed(2)}°` : "no truth of that moment"}
    >
      <b>${seen.vehicle}</b>
      <span>${residual ? `${residual.position_mm.toFixed(1)} mm` : UNKNOWN}</span>
    </li>
  `;
}
