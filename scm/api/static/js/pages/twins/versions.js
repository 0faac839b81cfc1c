/** The versions of a car's file: which is in force, why, how much better it is, and the way to another. */
import { useState } from "preact/hooks";
import { amounts } from "scm/shared/amounts.js";
import { Dialog } from "scm/shared/dialog.js";
import { moment, spaced } from "scm/shared/format.js";
import { html } from "scm/shared/html.js";
import { change } from "scm/shell/api.js";
import { VERSIONS } from "scm/pages/twins/words.js";

const PLAIN = 0.95; // of an error, as the twin part requires of a better version
const ABILITIES = {
  cruise_mps: "Speed at 0.8 throttle", stopping_m: "Way to stop from there", turning_radius_m: "Tightest radius",
};
const ERRORS = { yaw_rad: "heading", gyro_rad: "yaw rate", wheel_m: "distance, wheels" };

export function Versions({ car, onChanged }) {
  const [chosen, choose] = useState(null);
  return html`
    <section class="panel versions" aria-label="Versions">
      <div class="panel-head"><h2>Versions of its car file</h2></div>
      <ul>
        ${car.versions.toReversed().map(
          (one) => html`<${Version} key=${one.number} version=${one} inForce=${one.number === car.version} onUse=${() => choose(one)} />`,
        )}
      </ul>
      ${chosen && html`<${Use} car=${car} version=${chosen} onClose=${() => choose(null)} onChanged=${onChanged} />`}
    </section>
  `;
}

function Version({ version, inForce, onUse }) {
  const { number, state, effects, by, reason, report, made_ns } = version;
  return html`
    <li data-version=${number} data-state=${state} data-in-force=${inForce}>
      <div class="line">
        <b>Version ${number}</b>
        <span class="badge" data-on=${inForce}>${inForce ? "in force" : VERSIONS[state]}</span>
        ${!inForce && html`<button class="small" aria-label="Use version ${number}" onClick=${onUse}>Use this version…</button>`}
      </div>
      <p>${number === 0 ? "The file that the car came with" : `With ${effects.map(spaced).join(" and ") || "other numbers"}, found ${moment(made_ns)}`}</p>
      ${state === "candidate" && html`<p class="quiet">It is compared with the version in force on new driving.</p>`}
      ${(by || reason) && html`<p class="quiet">${VERSIONS[state]}${by && ` by ${by}`}${reason && `: ${reason}`}</p>`}
      ${version.errors.length > 0 && html`<${Errors} version=${version} />`}
      ${version.abilities.length > 0 && html`<${Abilities} version=${version} />`}
      <p class="quiet file"><code>${version.file}</code>${report && html` <a href="/mismatch/${report}">report</a>`}</p>
    </li>
  `;
}

/** Errors of predictions after 3 s, by the version before and by this one. */
function Errors({ version }) {
  return html`
    <dl class="errors" aria-label="Errors 3 s ahead, in ${version.windows} windows">
      ${version.errors.map(({ name, before, now }) => {
        const [then, here] = amounts(name, [before, now]);
        return html`
          <dt>${ERRORS[name] ?? spaced(name.replace(/_[a-z0-9]+$/, ""))}</dt>
          <dd data-side=${now < PLAIN * before ? "better" : now > before / PLAIN ? "worse" : "same"}>${then} → ${here}</dd>
        `;
      })}
    </dl>
  `;
}

/** What the car can do by it, with the 90 % interval, and could before. */
function Abilities({ version }) {
  return html`
    <dl class="abilities" aria-label="What the car can do">
      ${version.abilities.map(({ name, unit, value, low, high, before }) => {
        const [now, least, most, then] = amounts(name, [value, low, high, before], { unit });
        const hasChanged = before < low || before > high;
        return html`
          <dt>${ABILITIES[name] ?? spaced(name)}</dt>
          <dd data-changed=${hasChanged}>${now} <small>${least.split(" ")[0]} to ${most}${hasChanged && `, before ${then}`}</small></dd>
        `;
      })}
    </dl>
  `;
}

function Use({ car, version, onClose, onChanged }) {
  const { number } = version;
  const submit = async (event) => {
    event.preventDefault();
    const body = { version: number, by: "dashboard", reason: event.target.elements.reason.value };
    onClose();
    const done = (reply) => `${car.vehicle} is predicted by version ${reply.version}.`;
    if (await change("PUT", `/twins/${car.vehicle}/version`, body, done)) onChanged();
  };
  return html`
    <${Dialog} title="Predict ${car.vehicle} by version ${number}?" onClose=${onClose}>
      <p>
        ${number < car.version ? "Versions after it are rolled back. " : ""}
        The twin learns anew how the car usually strays from it. The car itself drives as before.
      </p>
      <form onSubmit=${submit}>
        <input name="reason" maxlength="500" placeholder="Reason (optional)" aria-label="Reason" data-first />
        <div class="actions">
          <button type="button" onClick=${onClose}>Cancel</button>
          <button class="primary">Use version ${number}</button>
        </div>
      </form>
    <//>
  `;
}
