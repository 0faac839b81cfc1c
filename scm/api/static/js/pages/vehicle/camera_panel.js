/** What a car's cameras see. A film runs only while it is shown. */
import { signal, useSignal } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { span } from "scm/shared/format.js";
import { isOld, now } from "scm/shell/store.js";
import { isCrowded } from "scm/shell/streams.js";
import { watch } from "scm/pages/vehicle/film.js";
import { placed } from "scm/shared/base.js";

const CROWDED = "Other windows of this browser are open, and it grants no more connections.";

const camera = signal("front");

export function CameraPanel({ car }) {
  const shown = car.cameras.includes(camera.value) ? camera.value : car.cameras[0];
  const film = placed(`/api/v1/vehicles/${car.vehicle}/camera/${shown}/film`);
  return html`
    <section class="panel camera" aria-label="Camera">
      <div class="panel-head">
        <h2>Camera</h2>
        <div class="choices" role="group" aria-label="Camera">
          ${car.cameras.map(
            (name) => html`
              <button class="small" aria-pressed=${shown === name} onClick=${() => (camera.value = name)}>${name}</button>
            `,
          )}
        </div>
      </div>
      ${shown
        ? html`<${Film} key=${film} src=${film} label="What the ${shown} camera of ${car.vehicle} sees" />`
        : html`<p class="empty">This car has no cameras.</p>`}
    </section>
  `;
}

/** The newest picture; grey when no newer one came, and then how old it is. */
function Film({ src, label }) {
  const canvas = useRef(null);
  const drawnAt = useSignal(null);
  const [large, setLarge] = useState(false);
  useEffect(() => {
    const draw = (picture) => {
      Object.assign(canvas.current, { width: picture.width, height: picture.height });
      canvas.current.getContext("2d").drawImage(picture, 0, 0);
      drawnAt.value = performance.now();
    };
    return watch(src, draw);
  }, [src]);
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
      ${!seen && html`<span class="empty">${isCrowded.value ? CROWDED : "Waiting for a picture."}</span>`}
      ${late && isCrowded.value && html`<span class="empty">${CROWDED}</span>`}
      ${late && html`<span class="late">${span((now.value - drawnAt.value) / 1000)} old</span>`}
    </button>
  `;
}
