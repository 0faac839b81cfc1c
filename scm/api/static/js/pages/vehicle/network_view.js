/** A network that drives the car: what it commands by a frame, how fast, and which parts of the frame it steers by. */
import { computed, signal } from "@preact/signals";
import { html } from "scm/shared/html.js";
import { fixed } from "scm/shared/format.js";
import { now } from "scm/shell/store.js";
import { network, networkAt } from "scm/pages/vehicle/reports.js";

const GONE_MS = 3000; // after the newest: the slowest network takes 2 s for a saliency
const LEAST = 0.02; // of steering: weaker saliency than this is not amplified to full colour
const OPAQUE = 0.75; // of the strongest cell
const TO_LEFT = [38, 128, 255];
const TO_RIGHT = [255, 106, 0];
const UNSEEN = "rgb(5 8 11 / 45%)"; // over what the network does not see
const NEEDLE_DEG = 60; // at full steering

/** Whether the picture shows the saliency. */
export const isSalient = signal(false);

/** What the network made of the newest frame; null: no network drives. */
const driving = computed(() => (now.value - networkAt.value < GONE_MS ? network.value : null));

/** The same, where it drives by the camera that is shown. */
export const networkOf = (camera) => (driving.value?.camera === camera ? driving.value : null);

/** Over the picture: the steering as a needle, + = left, and the throttle as a bar. */
export function Commands({ view }) {
  return html`
    <span class="commands" aria-hidden="true">
      <svg viewBox="-42 -46 84 50">
        <path class="scale" d="M-34.6 -20A40 40 0 0 1 34.6 -20" />
        <path class="zero" d="M0 -44V-36" />
        <path class="needle" d="M0 0V-38" transform="rotate(${-NEEDLE_DEG * view.steering})" />
      </svg>
      <b>${sided(view.steering)}</b>
      <svg class="throttle" viewBox="0 -1 1 2" preserveAspectRatio="none">
        <rect x="0" width="1" y=${Math.min(0, -view.throttle)} height=${Math.abs(view.throttle)} />
        <path class="zero" d="M0 0H1" />
      </svg>
      <b>${fixed(view.throttle, 2)}</b>
    </span>
  `;
}

/** Below the picture: the same in words, and how long it took. */
export function NetworkFacts({ view }) {
  return html`
    <dl class="network">
      <dt>Driven by</dt><dd>${view.network}, <span class="file">${view.file}</span></dd>
      <dt>Commands</dt><dd>steering ${sided(view.steering)}, throttle ${fixed(view.throttle, 2)}</dd>
      <dt>Exposure to command</dt><dd data-fact="delay">${ms(view.delay_s)}</dd>
      <dt>Of these, inference</dt><dd data-fact="inference">${ms(view.inference_s)}</dd>
      ${isSalient.value &&
      html`
        <dt>Saliency</dt>
        <dd data-fact="saliency"><i data-side="left"></i> pulls left, <i data-side="right"></i> right, up to ${fixed(strongest(view), 2)}</dd>
      `}
    </dl>
  `;
}

/** Draw the saliency over the frame that it belongs to, which is on `paper` already. */
export function drawSaliency(paper, { top, rows, columns, saliency }) {
  if (!saliency.length || saliency.length !== rows * columns) return;
  const cells = new OffscreenCanvas(columns, rows);
  const small = cells.getContext("2d");
  const image = small.createImageData(columns, rows);
  const most = Math.max(LEAST, strongest({ saliency }));
  saliency.forEach((change, i) => {
    const colour = change < 0 ? TO_LEFT : TO_RIGHT; // blurred, it steers less to the left: it pulls there
    image.data.set([...colour, 255 * OPAQUE * (Math.abs(change) / most)], 4 * i);
  });
  small.putImageData(image, 0, 0);
  const { width, height } = paper.canvas;
  paper.fillStyle = UNSEEN;
  paper.fillRect(0, 0, width, top * height);
  paper.imageSmoothingQuality = "high";
  paper.drawImage(cells, 0, top * height, width, (1 - top) * height);
}

const strongest = ({ saliency }) => saliency.reduce((most, change) => Math.max(most, Math.abs(change)), 0);

const ms = (seconds) => `${fixed(1000 * seconds, seconds < 0.01 ? 1 : 0)} ms`;

function sided(steering) {
  const side = steering > 0 ? " left" : " right";
  return `${fixed(Math.abs(steering), 2)}${Math.abs(steering) < 0.005 ? "" : side}`;
}
