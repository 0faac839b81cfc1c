/** Each signal group now: lamp with letter and place, what is promised, what is likely, what is detected. */
import { html } from "scm/shared/html.js";
import { city, link, now, signalsAt } from "scm/shell/store.js";
import { status } from "scm/pages/signals/store.js";
import { plain, promised, WORDS } from "scm/pages/signals/words.js";
import { wishFor } from "scm/pages/signals/wishes.js";

const LAMPS = [
  ["red", "R"],
  ["yellow", "Y"],
  ["green", "G"],
];

export function Heads({ told }) {
  const detectors = new Map((status()?.detectors ?? []).map((one) => [one.group, one]));
  return html`
    <section class="heads" data-many=${told.groups.length > 4} aria-label="Signal groups">
      ${told.groups.map(
        (group) => html`
          <${Head}
            key=${group.group}
            group=${group}
            junction=${told.junction}
            detector=${detectors.get(group.group)}
          />
        `,
      )}
    </section>
  `;
}

function Head({ group, junction, detector }) {
  const heard = link.value === "live" || link.value === "connecting" ? group.colour : null;
  const passed_s = (now.value - signalsAt.value) / 1000;
  const lights = (city.value?.lights ?? []).filter(
    (light) => light.junction === junction && light.group === group.group,
  );
  const name = plain(group.group);
  return html`
    <article class="panel head" data-group=${group.group} data-colour=${heard ?? "unknown"}>
      <${Lamp} colour=${heard} name=${name} />
      <div class="told">
        <h3>${name} <small>${lights.map((light) => light.light_id).join(" ")}</small></h3>
        <p class="left"><b>${heard ? promised(group, passed_s) : "—"}</b>
          <small>${heard ? next(group) : ""}</small></p>
        <p class="likely">${heard ? likely(group, passed_s) : "not heard"}</p>
        <p class="seen">${detected(detector)}</p>
      </div>
      <div class="quick">
        ${["call", "hold", "force_off"].map(
          (verb) => html`
            <button
              key=${verb}
              class="small"
              aria-label="${verb.replace("_", " ")} ${name}"
              onClick=${() => wishFor(verb, group.group)}
            >
              ${{ call: "Call", hold: "Hold", force_off: "Force off" }[verb]}
            </button>
          `,
        )}
      </div>
    </article>
  `;
}

/** Three lamps, one lit: colour, letter and place say the same. */
function Lamp({ colour, name }) {
  const flashing = colour === "flashing_red";
  const lit = flashing ? "red" : colour;
  return html`
    <div class="lamps" role="img" aria-label="${name} shows ${WORDS[colour] ?? "nothing known"}">
      ${LAMPS.map(
        ([which, letter]) => html`
          <i key=${which} data-lamp=${which} data-lit=${which === lit} data-flashing=${flashing && which === lit}>
            ${which === lit ? (flashing ? "F" : letter) : ""}
          </i>
        `,
      )}
    </div>
  `;
}

function next({ colour, next_colour }) {
  if (colour === "flashing_red") return "stop, look, go in turn";
  return next_colour ? `then ${WORDS[next_colour]}` : "";
}

function likely(group, passed_s) {
  if (group.colour === "flashing_red") return "no promise while it flashes";
  if (group.likely_s === null) return "no forecast";
  const left = Math.max(0, group.likely_s - Math.max(0, passed_s)).toFixed(1);
  if (group.likely_confidence >= 1) return "promised exactly";
  return `likely ${left} s · ${Math.round(100 * group.likely_confidence)} % sure`;
}

function detected(detector) {
  if (!detector) return "detectors idle";
  const queue = detector.queue ? `, ${detector.queue} queued` : "";
  return detector.call ? `call${queue}` : `no call${queue}`;
}
