/** The Eye: its newest picture with the tags found drawn over it, and how far off each pose is. */
import { useEffect, useRef } from "preact/hooks";
import { html } from "./html.js";
import { byName, fixed, span, UNKNOWN } from "./format.js";
import { selected } from "./selection.js";
import { cameras } from "./store.js";

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
  const loading = useRef(false);
  const { frame_t_ns, tags } = camera;
  const seen = camera.seen.toSorted((a, b) => byName(a.vehicle, b.vehicle));
  useEffect(() => {
    if (frame_t_ns === null || loading.current) return;
    loading.current = true;
    const image = new Image();
    image.onload = () => {
      loading.current = false;
      if (canvas.current) draw(canvas.current, image, tags);
    };
    image.onerror = () => (loading.current = false);
    image.src = `/api/v1/eye/${camera.camera}/frame.jpg?t_ns=${frame_t_ns}`;
  }, [frame_t_ns]);
  return html`
    <div class="panel-head">
      <h2>Eye <small>${camera.camera}</small></h2>
      <span class="facts">
        ${`${tags.length} tags · ${fixed(camera.latency_ms, 0, " ms")} · `}
        <span class=${camera.age_s > 1 ? "warn" : ""}>${span(camera.age_s)}</span>
      </span>
    </div>
    <canvas
      ref=${canvas}
      class="picture"
      width=${camera.width_px ?? 16}
      height=${camera.height_px ?? 9}
      role="img"
      aria-label="Picture of camera ${camera.camera} with ${tags.length} tags found"
      data-frame=${frame_t_ns}
    ></canvas>
    <ul class="residuals" aria-label="Pose residual against the world's truth">
      ${seen.map((one) => html`<${Seen} key=${one.vehicle} seen=${one} />`)}
    </ul>
  `;
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

function draw(canvas, image, tags) {
  canvas.width = image.naturalWidth;
  canvas.height = image.naturalHeight;
  const paper = canvas.getContext("2d");
  paper.drawImage(image, 0, 0);
  const shown = canvas.clientWidth || canvas.width;
  const pixel = canvas.width / shown; // one pixel of the screen, in the picture's
  for (const tag of tags) drawTag(paper, tag, pixel);
}

function drawTag(paper, tag, pixel) {
  paper.beginPath();
  for (const [x, y] of tag.corners_px) paper.lineTo(x + 0.5, y + 0.5);
  paper.closePath();
  paper.lineJoin = "round";
  paper.lineWidth = 4 * pixel;
  paper.strokeStyle = "rgba(0, 20, 15, 0.65)";
  paper.stroke();
  paper.lineWidth = 2 * pixel;
  paper.strokeStyle = "#38e8b0";
  paper.stroke();
  const top = Math.min(...tag.corners_px.map(([, y]) => y));
  const text = String(tag.tag_id);
  paper.font = `600 ${11 * pixel}px system-ui, sans-serif`;
  paper.textAlign = "center";
  const width = paper.measureText(text).width + 8 * pixel;
  const [x] = tag.centre_px;
  const y = Math.max(top - 4 * pixel, 15 * pixel);
  paper.fillStyle = "rgba(6, 20, 16, 0.85)";
  paper.beginPath();
  paper.roundRect(x - width / 2, y - 14 * pixel, width, 15 * pixel, 3 * pixel);
  paper.fill();
  paper.fillStyle = "#7ff5d2";
  paper.fillText(text, x, y - 3 * pixel);
}
