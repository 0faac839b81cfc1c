/** What a car's cameras see, and what a network that drives by one makes of it. A film runs only while it is shown. */
import { signal, useSignal } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { span } from "scm/shared/format.js";
import { isOld, now } from "scm/shell/store.js";
import { isCrowded } from "scm/shell/streams.js";
import { watch } from "scm/pages/vehicle/film.js";
import { Commands, drawSaliency, isSalient, NetworkFacts, networkOf } from "scm/pages/vehicle/network_view.js";
import { placed } from "scm/shared/base.js";

const CROWDED = "Other windows of this browser are open, and it grants no more connections.";

const STORED = 30; // frames: 2 s at 15 Hz, in which a saliency comes after its frame

const camera = signal("front");

export function CameraPanel({ car }) {
  const shown = car.cameras.includes(camera.value) ? camera.value : car.cameras[0];
  const film = placed(`/api/v1/vehicles/${car.vehicle}/camera/${shown}/film`);
  const view = networkOf(shown);
  return html`
    <section class="panel camera" aria-label="Camera">
      <div class="panel-head">
        <h2>Camera</h2>
        <div class="choices" role="group" aria-label="Camera">
          ${view &&
          html`<button class="small" aria-pressed=${isSalient.value} title="Which parts of the picture the steering depends on" onClick=${() => (isSalient.value = !isSalient.value)}>saliency</button>`}
          ${car.cameras.map(
            (name) => html`
              <button class="small" aria-pressed=${shown === name} onClick=${() => (camera.value = name)}>${name}</button>
            `,
          )}
        </div>
      </div>
      ${shown
        ? html`<${Film} key=${film} src=${film} view=${view} label="What the ${shown} camera of ${car.vehicle} sees" />`
        : html`<p class="empty">This car has no cameras.</p>`}
      ${view && html`<${NetworkFacts} view=${view} />`}
    </section>
  `;
}

/**
 * The newest picture; grey when no newer one came, and then how old it is. With saliency it is the frame to which the
 * newest one belongs.
 */
function Film({ src, view, label }) {
  const canvas = useRef(null);
  const drawnAt = useSignal(null);
  const [large, setLarge] = useState(false);
  const frames = useRef(new Map()); // JPEGs by when they were exposed [ns]
  const shown = isSalient.value ? view : null;
  const draw = useRef(null);
  draw.current = (picture, of) => {
    if (of !== shown || !canvas.current) return;
    Object.assign(canvas.current, { width: picture.width, height: picture.height });
    const paper = canvas.current.getContext("2d");
    paper.drawImage(picture, 0, 0);
    if (of) drawSaliency(paper, of);
    drawnAt.value = performance.now();
  };
  useEffect(() => {
    const store = (jpeg, t_ns) => {
      frames.current.set(t_ns, jpeg);
      if (frames.current.size > STORED) frames.current.delete(frames.current.keys().next().value);
    };
    return watch(src, (picture) => draw.current(picture, null), store);
  }, [src]);
  useEffect(() => {
    const jpeg = shown && frames.current.get(shown.t_ns);
    if (jpeg) createImageBitmap(jpeg).then((picture) => (draw.current(picture, shown), picture.close()));
  }, [shown]);
  const seen = drawnAt.value !== null;
  const late = seen && isOld(drawnAt.value);
  return html`
    <button
      class="film ${large ? "large" : ""}"
      data-seen=${seen}
      aria-pressed=${large}
      title=${large ? "Smaller" : "Larger"}
      onClick=${() => setLarge(!large)}
      onKeyDown=${(event) => event.key === "Escape" && setLarge(false)}
    >
      <canvas ref=${canvas} class="moves" data-stale=${late} role="img" aria-label=${label}></canvas>
      ${seen && view && html`<${Commands} view=${view} />`}
      ${!seen && html`<span class="empty">${isCrowded.value ? CROWDED : "Waiting for a picture."}</span>`}
      ${late && isCrowded.value && html`<span class="empty">${CROWDED}</span>`}
      ${late && html`<span class="late">${span((now.value - drawnAt.value) / 1000)} old</span>`}
    </button>
  `;
}
