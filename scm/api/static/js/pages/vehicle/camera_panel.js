/** What a car's cameras see. A film runs only while it is shown. */
import { signal } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";

const camera = signal("front");

export function CameraPanel({ car }) {
  const shown = car.cameras.includes(camera.value) ? camera.value : car.cameras[0];
  const film = `/api/v1/vehicles/${car.vehicle}/camera/${shown}/film`;
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

/** A film of JPEG pictures. Its request lives as long as the picture is on the screen, no longer. */
function Film({ src, label }) {
  const image = useRef(null);
  const [seen, setSeen] = useState(false);
  const [large, setLarge] = useState(false);
  useEffect(() => {
    const follow = () => {
      if (document.hidden) image.current.removeAttribute("src");
      else image.current.src = src;
    };
    const element = image.current;
    follow();
    document.addEventListener("visibilitychange", follow);
    return () => {
      document.removeEventListener("visibilitychange", follow);
      element.removeAttribute("src"); // ends the request: a picture out of the page would go on
    };
  }, [src]);
  return html`
    <button
      class="film ${large ? "large" : ""}"
      data-seen=${seen}
      aria-pressed=${large}
      title=${large ? "Smaller" : "Larger"}
      onClick=${() => setLarge(!large)}
      onKeyDown=${(event) => event.key === "Escape" && setLarge(false)}
    >
      <img ref=${image} alt=${label} onLoad=${() => setSeen(true)} onError=${() => setSeen(false)} />
      ${!seen && html`<span class="empty">Waiting for a picture.</span>`}
    </button>
  `;
}
