/** The bar on top: which city, how alive it is, and the red button. */
import { signal } from "@preact/signals";
import { html } from "./html.js";
import { change } from "./api.js";
import { Dialog } from "./dialog.js";
import { clock, fixed, span, UNKNOWN } from "./format.js";
import { city, isConnected, link, quiet_s, stop, world } from "./store.js";

const asking = signal(false);

const LINK_WORDS = { connecting: "Connecting", live: "Live", stale: "Stale", lost: "No data" };

export function TitleBar() {
  const { t_ns, real_time_factor, late_ticks, cars } = world.value;
  const heard = t_ns !== null;
  return html`
    <header class="title-bar">
      <img class="mark" src="/static/icon.svg" alt="" />
      <h1>${city.value ? city.value.title : "Smart City Manager"}</h1>
      <span class="link-state" data-link=${link.value} role="status">
        <i></i>${LINK_WORDS[link.value]}
      </span>
      <dl class="vitals">
        <${Vital} name="Time" value=${heard ? clock(t_ns) : UNKNOWN} />
        <${Vital}
          name="Real-time factor"
          value=${heard ? `×${fixed(real_time_factor, 2)}` : UNKNOWN}
          warn=${heard && real_time_factor < 0.95}
        />
        <${Vital} name="Late ticks" value=${heard ? late_ticks : UNKNOWN} />
        <${Vital} name="Cars" value=${heard ? cars.length : UNKNOWN} />
      </dl>
      <${StopButton} />
    </header>
  `;
}

function Vital({ name, value, warn }) {
  return html`<div class=${warn ? "warn" : ""}><dt>${name}</dt><dd>${value}</dd></div>`;
}

function StopButton() {
  const engaged = stop.value.engaged;
  const label = engaged ? "Release stop" : "City stop";
  return html`
    <button
      id="city-stop"
      class="city-stop"
      aria-pressed=${engaged}
      onClick=${() => (asking.value = true)}
    >
      ${label}
    </button>
    ${asking.value && html`<${StopDialog} engaged=${engaged} />`}
  `;
}

function StopDialog({ engaged }) {
  const close = () => (asking.value = false);
  const submit = async (event) => {
    event.preventDefault();
    const reason = event.target.elements.reason.value;
    close();
    await change("PUT", "/stop", { engaged: !engaged, by: "dashboard", reason }, (reply) =>
      reply.engaged ? "All cars are told to stop." : "The stop is released.",
    );
  };
  // Enter must stop the city: the button has the focus, not the reason.
  const verb = engaged ? "Let all cars drive again" : "Stop all cars";
  return html`
    <${Dialog} title=${engaged ? "Release the city stop?" : "Stop the whole city?"} onClose=${close}>
      <p>
        ${engaged
          ? "Every car goes on with what it was doing. Look at the map first."
          : "Every car brakes and stands, whoever drives it, until the stop is released."}
      </p>
      <form onSubmit=${submit}>
        <input name="reason" maxlength="200" placeholder="Reason (optional)" aria-label="Reason" />
        <div class="actions">
          <button type="button" onClick=${close}>Cancel</button>
          <button class=${engaged ? "primary" : "danger"} data-first>${verb}</button>
        </div>
      </form>
    <//>
  `;
}

export function Banners() {
  const { engaged, by, reason } = stop.value;
  const lost = link.value === "lost" || (link.value === "connecting" && quietSinceStart());
  return html`
    ${engaged &&
    html`<div class="banner stopped" role="alert">
      <b>City stopped</b>
      <span>${[by && `by ${by}`, reason].filter(Boolean).join(" · ")}</span>
    </div>`}
    ${lost &&
    html`<div class="banner lost" role="alert">
      <b>${isConnected.value ? "The world is silent" : "No connection to the server"}</b>
      <span>
        ${world.value.t_ns === null
          ? "Nothing has been heard yet."
          : `What you see is ${span(quiet_s.value)} old.`}
      </span>
    </div>`}
  `;
}

function quietSinceStart() {
  return performance.now() > 3000 && quiet_s.value > 2;
}
