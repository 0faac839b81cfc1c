/** Each signal group now: lamp with letter and place, guaranteed times, likely end, detections. */
import { html } from "scm/shared/html.js";
import { city, link, now, signalsAt } from "scm/shell/store.js";
import { status } from "scm/pages/signals/store.js";
import { plain, guaranteed, WORDS } from "scm/pages/signals/words.js";
import { requestFor } from "scm/pages/signals/overrides.js";

const LAMPS = [
  ["red", "R"],
  ["yellow", "Y"],
  ["green", "G"],
];

export function Heads({ current }) {
  const detectors = new Map((status()?.detectors ?? []).map((one) => [one.group, one]));
  return html`
    <section class="heads" data-many=${current.groups.length > 4} aria-label="Signal groups">
      ${current.groups.map(
        (group) => html`
          <${Head}
            key=${group.group}
            group=${group}
            junction=${current.junction}
            detector=${detectors.get(group.group)}
          />
        `,
      )}
    </section>
  `;
}

function Head({ group, junction, detector }) {
  const shownColour = link.value === "live" || link.value === "connecting" ? group.colour : null;
  const passed_s = (now.value - signalsAt.value) / 1000;
  const lights = (city.value?.lights ?? []).filter(
    (light) => light.junction === junction && light.group === group.group,
  );
  const name = plain(group.group);
  return html`
    <article class="panel head" data-group=${group.group} data-colour=${shownColour ?? "unknown"}>
      <${Lamp} colour=${shownColour} name=${name} />
      <div class="published">
        <h3>${name} <small>${lights.map((light) => light.light_id).join(" ")}</small></h3>
        <p class="left"><b>${shownColour ? guaranteed(group, passed_s) : "—"}</b>
          <small>${shownColour ? next(group) : ""}</small></p>
        <p class="likely">${shownColour ? likely(group, passed_s) : "no report"}</p>
        <p class="seen">${detected(detector)}</p>
      </div>
      <div class="quick">
        ${["call", "hold", "force_off"].map(
          (verb) => html`
            <button
              key=${verb}
              class="small"
              aria-label="${verb.replace("_", " ")} ${name}"
              onClick=${() => requestFor(verb, group.group)}
            >
              ${{ call: "Call", hold: "Hold", force_off: "Force off" }[verb]}
            </button>
          `,
        )}
      </div>
    </article>
  `;
}

/** Three lamps, one lit: colour, letter and place show the same. */
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
  if (group.colour === "flashing_red") return "no guaranteed time while it flashes";
  if (group.likely_s === null) return "no forecast";
  const left = Math.max(0, group.likely_s - Math.max(0, passed_s)).toFixed(1);
  if (group.likely_confidence >= 1) return "guaranteed exactly";
  return `likely ${left} s · ${Math.round(100 * group.likely_confidence)} % sure`;
}

function detected(detector) {
  if (!detector) return "detectors idle";
  const queue = detector.queue ? `, ${detector.queue} queued` : "";
  return detector.call ? `call${queue}` : `no call${queue}`;
}
