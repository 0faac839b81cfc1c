/** The bar on top: which city, its pages, how alive it is, and the red button. */
import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { change, notify } from "scm/shell/api.js";
import { prose } from "scm/shell/prose.js";
import { Dialog } from "scm/shared/dialog.js";
import { clock, fixed, spaced, span, UNKNOWN } from "scm/shared/format.js";
import { city, isConnected, link, pulse, quiet_s, stop } from "scm/shell/store.js";
import { isShutOut, makeRoom } from "scm/shell/streams.js";
import { nextTheme, theme } from "scm/shell/theme.js";

/** The open dialog of the stop: `release`, `reason`; null: none. */
const openDialog = signal(null);

/** Whether a stop was requested but never confirmed. */
const unconfirmed = signal(false);

const ROOM_MS = 300;
const CONFIRM_TIMEOUT_MS = 2500; // the city tries to reach the world for 2 s
const PATIENCE_MS = 5000;

const LINK_WORDS = { connecting: "Connecting", live: "Live", stale: "Stale", lost: "No data" };

const THEMES = { system: ["◐", "as the system"], light: ["☀", "light"], dark: ["☾", "dark"] };

export function TitleBar({ pages, here }) {
  const { t_ns, real_time_factor } = pulse.value;
  const nav = useRef(null);
  useEffect(() => showHere(nav.current), [here]);
  const isKnown = t_ns !== null;
  const vitals = isKnown
    ? `real-time factor ${fixed(real_time_factor, 2)}: ${fixed(real_time_factor, 2)} s of each second are simulated`
    : "nothing received from the world yet";
  return html`
    <header class="title-bar">
      <a class="home" href="/map" title=${city.value?.title ?? "Smart City Manager"}>
        <img class="mark" src="/static/icon.svg" alt="" />
        <h1>${city.value ? city.value.title : "Smart City Manager"}</h1>
      </a>
      <nav aria-label="Pages" ref=${nav}>
        ${pages.filter((page) => !page.under).map(
          (page) => html`
            <a key=${page.name} href="/${page.name}" aria-current=${page.name === here ? "page" : null}>
              ${page.title}
            </a>
          `,
        )}
      </nav>
      <span class="link-state" data-link=${link.value} role="status" title=${vitals}>
        <i></i>${LINK_WORDS[link.value]}
      </span>
      <span class="clock ${isKnown && real_time_factor < 0.95 ? "warn" : ""}" title=${vitals}>
        ${isKnown ? clock(t_ns) : UNKNOWN}
        <small>×${isKnown ? fixed(real_time_factor, 2) : UNKNOWN}</small>
      </span>
      <${ThemeButton} />
      <${StopButton} />
    </header>
  `;
}

/** On a narrow screen the row of pages scrolls: the one that is open stands in its middle. */
function showHere(nav) {
  const link = nav.querySelector("[aria-current]");
  if (link) nav.scrollLeft = link.offsetLeft - nav.offsetLeft - (nav.clientWidth - link.offsetWidth) / 2;
}

function ThemeButton() {
  const [sign, words] = THEMES[theme.value];
  const label = `Colours: ${words}`;
  return html`
    <button class="plain theme" title=${label} aria-label=${label} onClick=${nextTheme}>${sign}</button>
  `;
}

/** One press stops, as with every emergency stop; only releasing it asks for confirmation. */
function StopButton() {
  const engaged = stop.value.engaged;
  const press = () => (engaged ? (openDialog.value = "release") : sendStop({ engaged: true, by: "dashboard", reason: "" }));
  return html`
    <button id="city-stop" class="city-stop" aria-pressed=${engaged} onClick=${press}>
      ${engaged ? "Release stop" : "City stop"}
    </button>
    ${openDialog.value === "release" && html`<${ReleaseDialog} />`}
    ${openDialog.value === "reason" && html`<${ReasonDialog} />`}
  `;
}

const closeDialog = () => (openDialog.value = null);

/** Who hits the red button again and again must not release it: Enter means no here. */
function ReleaseDialog() {
  const submit = (event) => {
    event.preventDefault();
    closeDialog();
    sendStop({ engaged: false, by: "dashboard", reason: event.target.elements.reason.value });
  };
  return html`
    <${Dialog} title="Release the city stop?" onClose=${closeDialog}>
      <p>Every car goes on with what it was doing. Look at the map first.</p>
      <form onSubmit=${submit}>
        <input name="reason" maxlength="200" placeholder="Reason (optional)" aria-label="Reason" />
        <div class="actions">
          <button type="button" data-first onClick=${closeDialog}>Cancel</button>
          <button class="primary">Let all cars drive again</button>
        </div>
      </form>
    <//>
  `;
}

/** Why the city was stopped: for the log, and for whoever finds it standing. */
function ReasonDialog() {
  const submit = (event) => {
    event.preventDefault();
    closeDialog();
    if (stop.value.engaged) sendStop({ engaged: true, by: "dashboard", reason: event.target.elements.reason.value });
    else notify("error", "The stop was released meanwhile: the reason was not noted.");
  };
  return html`
    <${Dialog} title="Why was the city stopped?" onClose=${closeDialog}>
      <form onSubmit=${submit}>
        <input name="reason" maxlength="200" required placeholder="Reason (needed)" aria-label="Reason" data-first />
        <div class="actions">
          <button type="button" onClick=${closeDialog}>Cancel</button>
          <button class="primary">Note it</button>
        </div>
      </form>
    <//>
  `;
}

/** Whatever else the browser waits for, this goes first; an answer that does not come is as good as none. */
async function sendStop(body) {
  const waits = [
    setTimeout(makeRoom, ROOM_MS),
    setTimeout(() => (unconfirmed.value = body.engaged), CONFIRM_TIMEOUT_MS),
  ];
  const done = ({ engaged }) => (engaged ? "All cars are ordered to stop." : "The stop is released.");
  const reply = await change("PUT", "/stop", body, done, {}, PATIENCE_MS);
  waits.forEach(clearTimeout);
  unconfirmed.value = body.engaged && reply === null;
}

export function Banners() {
  const { engaged, by, reason } = stop.value;
  const lost = link.value === "lost" || (link.value === "connecting" && quietSinceStart());
  return html`
    ${engaged &&
    html`<div class="banner stopped" role="alert">
      <b>City stopped</b>
      <span>${[by && `by ${by}`, reason, obeyed()].filter(Boolean).join(" · ")}</span>
      ${!reason && html`<button onClick=${() => (openDialog.value = "reason")}>Give a reason…</button>`}
    </div>`}
    ${unconfirmed.value &&
    !engaged &&
    html`<div class="banner lost" role="alert">
      <b>The stop is not confirmed</b>
      <span>Cars may still drive. Press City stop again, or switch them off by hand.</span>
      <button onClick=${() => (unconfirmed.value = false)}>Dismiss</button>
    </div>`}
    ${lost &&
    html`<div class="banner lost" role="alert">
      <b>${silence()}</b>
      <span>
        ${pulse.value.t_ns !== null
          ? `What you see is ${span(quiet_s.value)} old.`
          : isConnected.value
            ? "Nothing received yet. The first start on a computer compiles its physics, a minute or longer."
            : "Nothing received yet."}
        ${isShutOut.value ? " Other windows of this browser hold all connections that it grants: close one." : ""}
      </span>
    </div>`}
    ${link.value === "live" &&
    pulse.value.silent_signals.length > 0 &&
    html`<div class="banner lost" role="alert">
      <b>The signals of ${pulse.value.silent_signals.map(spaced).join(", ")} are silent</b>
      <span>What they show is not known here. Lights that nobody runs flash red by themselves.</span>
    </div>`}
    ${link.value === "live" && html`<${DisturbanceBanner} />`}
  `;
}

/** What makes measurements void at this moment; silent signals have a banner of their own. */
function DisturbanceBanner() {
  const shown = pulse.value.disturbances.filter(({ kind }) => kind !== "silent");
  if (!shown.length) return null;
  const since_ns = Math.min(...shown.map(({ start_ns }) => start_ns));
  const [late] = shown.filter(({ kind }) => kind === "late"); // where the world is late, the monitor is too
  const advice = late?.advice ?? [...new Set(shown.map((one) => one.advice).filter(Boolean))].join(" ");
  return html`
    <div class="banner void" role="status">
      <b>Measurements are void</b>
      <span>
        ${capital(shown.map(({ text }) => text).join("; "))}, since ${clock(since_ns)}. Trips meanwhile are void
        of the city. ${prose(advice)}
      </span>
    </div>
  `;
}

const capital = (words) => words.charAt(0).toUpperCase() + words.slice(1);

/** What became of the stop, as far as that is known now. */
function obeyed() {
  const { moving, vehicles } = pulse.value;
  if (link.value !== "live") return "";
  return moving ? `${moving} of ${vehicles} cars still move` : "all cars stand";
}

/** What no longer reports, or not yet. */
function silence() {
  if (isConnected.value) return pulse.value.t_ns === null ? "Waiting for the world" : "The world is silent";
  return isShutOut.value ? "Too many windows" : "No connection to the server";
}

function quietSinceStart() {
  return performance.now() > 3000 && quiet_s.value > 2;
}
