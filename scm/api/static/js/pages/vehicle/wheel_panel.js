/** Drive a car: acquire its lease, drive by keys, gamepad or pads, each with a dead-man, and release it. */
import { useEffect, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { fixed, UNKNOWN } from "scm/shared/format.js";
import { change } from "scm/shell/api.js";
import { city, stop } from "scm/shell/store.js";
import { isAtHome, ownerOf } from "scm/pages/vehicle/lease.js";
import { down, drivenBy, drop, giveBack, most, pad, acquire, wheel } from "scm/pages/vehicle/wheel.js";

const PADS = [
  ["ahead", "▲", "Ahead", "W"],
  ["left", "◀", "Left", "A"],
  ["back", "▼", "Back", "S"],
  ["right", "▶", "Right", "D"],
];
const WHY = {
  driving: "You drive",
  released: "No hand on the wheel: it stands",
  silent: "This page is silent: it stands",
  no_reply: "The city does not answer: the car stops by itself",
};

export function WheelPanel({ car }) {
  useEffect(() => drop, []);
  const { state } = wheel.value;
  return html`
    <section class="panel wheel" data-state=${state} aria-label="Drive by hand">
      <div class="panel-head">
        <h2>Drive by hand</h2>
        ${state === "held" && html`<span class="yours">You hold the wheel</span>`}
      </div>
      ${state === "held" ? html`<${Held} car=${car} />` : html`<${Free} car=${car} />`}
    </section>
  `;
}

function Free({ car }) {
  const { state, over } = wheel.value;
  const isLeased = !isAtHome(car);
  return html`
    <p>
      ${isLeased ? html`${car.vehicle} is driven by <b>${ownerOf(car)}</b>.` : afterwards(car)}
    </p>
    ${over && html`<p class="over" role="status" data-code=${over.code}>${reasonOf(over)}</p>`}
    ${isLeased
      ? html`<${Steal} car=${car} />`
      : html`
          <div class="actions">
            <button class="primary big" disabled=${state === "requesting" || !car.alive} onClick=${() => acquire(car.vehicle)}>
              ${state === "requesting" ? "Requesting …" : "Take over"}
            </button>
            ${stands(car) && city.value?.lanes.length > 0 &&
            html`<button class="big" disabled=${!car.alive} onClick=${() => sendOn(car)}>Let it drive</button>`}
          </div>
        `}
    <${Help} />
  `;
}

const stands = (car) => !car.trip || car.trip.arrived;

/** A car that stands without a trip, as after a script, keeps all behind it waiting. */
const sendOn = (car) => change("POST", `/vehicles/${car.vehicle}/route`, {}, () => `${car.vehicle} drives.`);

/** What becomes of a car that nobody has taken, when you give it back. */
function afterwards(car) {
  if (!stands(car)) return `${car.vehicle} is driven by ${ownerOf(car)}, which goes on when you give it back.`;
  return `${car.vehicle} stands, and stands again when you give it back.`;
}

/** Taking over a car from somebody needs a reason, which is logged as an event. */
function Steal({ car }) {
  const [reason, setReason] = useState("");
  const submit = (event) => {
    event.preventDefault();
    acquire(car.vehicle, reason.trim());
  };
  return html`
    <form class="steal" onSubmit=${submit}>
      <input aria-label="Reason" required maxlength="200" placeholder="Why you take over" value=${reason} onInput=${(event) => setReason(event.target.value)} />
      <button class="danger" disabled=${!reason.trim()}>Take over anyway</button>
    </form>
  `;
}

function Held({ car }) {
  const { status, round_ms } = wheel.value;
  const stopped = stop.value.engaged;
  const why = stopped ? "The city is stopped: nothing drives" : (WHY[status?.why] ?? "Waiting for the car");
  const by = !stopped && status?.why === "driving" && drivenBy.value === "gamepad" ? ", by gamepad" : "";
  return html`
    <p class="now" role="status" data-why=${stopped ? "stopped" : status?.why}>${why}${by}</p>
    <div class="instruments">
      <${Bar} name="Throttle" value=${status?.throttle ?? 0} />
      <${Bar} name="Steering" value=${-(status?.steering ?? 0)} shown=${status?.steering ?? 0} />
    </div>
    <dl>
      <dt>Speed</dt><dd>${fixed(status?.speed_mps, 2, " m/s")}</dd>
      <dt>Mode of the car</dt><dd>${status?.mode ?? UNKNOWN}</dd>
      <dt>Round trip</dt><dd data-fact="latency">${round_ms === null ? UNKNOWN : `${Math.round(round_ms)} ms`}</dd>
    </dl>
    <div class="pads" role="group" aria-label="Pads: hold to drive">
      ${PADS.map(([what, sign, word, letter]) => html`<${Pad} key=${what} what=${what} sign=${sign} word=${word} letter=${letter} />`)}
    </div>
    <label class="most">
      Most throttle <b>${Math.round(100 * most.value)} %</b>
      <input type="range" min="0.1" max="1" step="0.05" value=${most.value} onInput=${(event) => (most.value = Number(event.target.value))} />
    </label>
    <button class="give-back big" onClick=${giveBack}>Give ${car.vehicle} back</button>
  `;
}

function Pad({ what, sign, word, letter }) {
  const press = (event) => {
    event.currentTarget.setPointerCapture?.(event.pointerId);
    pad(what, true);
  };
  const up = () => pad(what, false);
  return html`
    <button
      class="pad"
      data-pad=${what}
      aria-label="${word}: hold"
      data-down=${down.value.split(" ").includes(what)}
      onPointerDown=${press}
      onPointerUp=${up}
      onPointerCancel=${up}
      onLostPointerCapture=${up}
      onContextMenu=${(event) => event.preventDefault()}
    ><span>${sign}</span><small>${letter}</small></button>
  `;
}

function Bar({ name, value, shown = value }) {
  return html`
    <label class="bar">
      <span>${name}</span>
      <meter class="hidden" min="-1" max="1" value=${shown}>${shown}</meter>
      <svg viewBox="-1 0 2 0.16" preserveAspectRatio="none" aria-hidden="true">
        <rect x=${Math.min(0, value)} y="0" width=${Math.abs(value)} height="0.16" />
        <line x1="0" x2="0" y1="0" y2="0.16" />
      </svg>
      <b>${fixed(shown, 2)}</b>
    </label>
  `;
}

function Help() {
  return html`
    <ul class="help">
      <li><kbd>W</kbd> <kbd>A</kbd> <kbd>S</kbd> <kbd>D</kbd> or arrows: hold to drive, let go to stop.</li>
      <li>Gamepad: hold a trigger; the left stick drives and steers.</li>
      <li>Hidden page, lost focus or 250 ms of silence: the car stops.</li>
    </ul>
  `;
}

function reasonOf({ code, detail }) {
  const begins = { given_back: "Given back", lost: "You lost the wheel", owned: "Not acquired", ended: "It ended", abandoned: "Given back" }[code];
  return begins ? `${begins}: ${detail}.` : detail;
}
