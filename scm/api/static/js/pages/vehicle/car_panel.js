/** The chosen car: what its cameras see, and its lights. A film runs only while it is shown. */
import { signal } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { change } from "scm/shell/api.js";
import { fixed } from "scm/shared/format.js";
import { selected } from "scm/shared/selection.js";
import { indicatorsOf, world } from "scm/shell/store.js";

const HEADLIGHTS = [["off", "Off"], ["low", "Low"], ["high", "High"]];
const INDICATORS = [["off", "Off"], ["left", "◀"], ["hazard", "◀ ▶"], ["right", "▶"]];
const WORDS = { left: "left", right: "right", hazard: "hazard", off: "off", low: "low", high: "high" };
const AUTOMATIC = ["tail", "brake", "reverse"];

const camera = signal("front");

/** The chosen car's row; null when none is chosen, or it left. */
export function chosenCar() {
  return world.value.vehicles.find((car) => car.vehicle === selected.value) ?? null;
}

export function CarPanel({ car }) {
  const shown = car.cameras.includes(camera.value) ? camera.value : car.cameras[0];
  const film = `/api/v1/vehicles/${car.vehicle}/camera/${shown}/film`;
  return html`
    <section class="panel car" aria-label="Car ${car.vehicle}">
      <div class="panel-head">
        <h2>${car.vehicle} <small>${car.car}, ${fixed(car.speed_mps, 2)} m/s</small></h2>
        <div class="tabs" role="group" aria-label="Camera">
          ${car.cameras.map(
            (name) => html`
              <button
                class="small"
                aria-pressed=${shown === name}
                onClick=${() => (camera.value = name)}
              >${name}</button>
            `,
          )}
        </div>
        <button class="plain" aria-label="Close" title="Close" onClick=${() => (selected.value = null)}>✕</button>
      </div>
      ${shown
        ? html`<${Film} key=${film} src=${film} label="What the ${shown} camera of ${car.vehicle} sees" />`
        : html`<p class="empty">This car has no cameras.</p>`}
      <${Lights} car=${car} />
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

function Lights({ car }) {
  const headlights = car.lights.includes("head_high")
    ? "high"
    : car.lights.includes("head_low")
      ? "low"
      : "off";
  const set = (body) => change("PUT", `/vehicles/${car.vehicle}/lights`, body);
  return html`
    <div class="switches">
      <${Switch}
        name="Headlights"
        choices=${HEADLIGHTS}
        now=${headlights}
        onPick=${(mode) => set({ headlights: mode })}
      />
      <${Switch}
        name="Indicators"
        choices=${INDICATORS}
        now=${indicatorsOf(car)}
        onPick=${(mode) => set({ indicators: mode })}
      />
      <div class="automatic" aria-label="Automatic lamps">
        ${AUTOMATIC.map(
          (lamp) => html`<span data-lamp=${lamp} data-on=${car.lights.includes(lamp)}><i></i>${lamp}</span>`,
        )}
      </div>
    </div>
  `;
}

function Switch({ name, choices, now, onPick }) {
  return html`
    <div class="switch" role="group" aria-label=${name}>
      <span>${name}</span>
      ${choices.map(
        ([mode, sign]) => html`
          <button
            class="small"
            aria-label="${name} ${WORDS[mode]}"
            aria-pressed=${mode === now}
            onClick=${() => onPick(mode)}
          >${sign}</button>
        `,
      )}
    </div>
  `;
}
