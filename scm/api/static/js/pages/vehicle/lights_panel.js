/** A car's lamps: the switches, and those that light by themselves. Who drives by hand has no switches here. */
import { html } from "scm/shared/html.js";
import { change } from "scm/shell/api.js";
import { indicatorsOf } from "scm/shell/store.js";
import { isAtHome } from "scm/pages/vehicle/lease.js";

const HEADLIGHTS = [["off", "Off"], ["low", "Low"], ["high", "High"]];
const INDICATORS = [["off", "Off"], ["left", "◀"], ["hazard", "◀ ▶"], ["right", "▶"]];
const WORDS = { left: "left", right: "right", hazard: "hazard", off: "off", low: "low", high: "high" };
const AUTOMATIC = ["tail", "brake", "reverse"];

export function LightsPanel({ car }) {
  const headlights = car.lights.includes("head_high") ? "high" : car.lights.includes("head_low") ? "low" : "off";
  const set = (body) => change("PUT", `/vehicles/${car.vehicle}/lights`, body);
  const locked = !isAtHome(car);
  return html`
    <section class="panel lights" aria-label="Lights">
      <div class="panel-head"><h2>Lights ${locked && html`<small>set by who drives it</small>`}</h2></div>
      <${Switch} name="Headlights" choices=${HEADLIGHTS} now=${headlights} locked=${locked} onPick=${(mode) => set({ headlights: mode })} />
      <${Switch} name="Indicators" choices=${INDICATORS} now=${indicatorsOf(car)} locked=${locked} onPick=${(mode) => set({ indicators: mode })} />
      <div class="automatic moves" aria-label="Automatic lamps">
        ${AUTOMATIC.map(
          (lamp) => html`<span data-lamp=${lamp} data-on=${car.lights.includes(lamp)}><i></i>${lamp}</span>`,
        )}
      </div>
    </section>
  `;
}

function Switch({ name, choices, now, locked, onPick }) {
  return html`
    <div class="switch" role="group" aria-label=${name}>
      <span>${name}</span>
      ${choices.map(
        ([mode, sign]) => html`
          <button
            class="small"
            aria-label="${name} ${WORDS[mode]}"
            aria-pressed=${mode === now}
            disabled=${locked}
            onClick=${() => onPick(mode)}
          >${sign}</button>
        `,
      )}
    </div>
  `;
}
