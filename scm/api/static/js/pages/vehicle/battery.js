/** A car's battery: how full it is, in shape, word and colour. */
import { html } from "scm/shared/html.js";
import { fixed } from "scm/shared/format.js";

const LOW = 0.2; // as in the city's event
const EMPTY = 0.05;

/** `none`, `unknown` (a voltage, and no charge), `good`, `low` or `empty`. */
export function batteryState({ battery_v: volts, battery_charge: charge }) {
  if (charge === null) return volts === null ? "none" : "unknown";
  if (charge < EMPTY) return "empty";
  return charge < LOW ? "low" : "good";
}

/** The word that a person must read; empty: all is well. */
export function batteryWord(car) {
  return { low: "low", empty: "empty" }[batteryState(car)] ?? "";
}

/** Where the charge comes from. */
function source(car) {
  if (car.battery_charge === null) return "";
  return car.kind === "real" ? "estimated from its voltage" : "simulated, counted";
}

/** The sign alone: filled as far as there is charge; low with a bang, empty struck through. */
export function BatterySign({ car }) {
  const state = batteryState(car);
  if (state === "none") return null;
  const width = 19 * (car.battery_charge ?? 0);
  return html`
    <svg class="battery" data-battery=${state} viewBox="0 0 28 14" aria-hidden="true">
      <rect class="case" x="1" y="1" width="23" height="12" rx="2.5" />
      <rect class="pole" x="25" y="4.5" width="2.5" height="5" rx="1" />
      ${state !== "unknown" && html`<rect class="fill" x="3" y="3" width=${width} height="8" rx="1" />`}
      ${state === "low" && html`<path class="sign" d="M14 3.2v4.6M14 10.2v0.9" />`}
      ${state === "empty" && html`<path class="sign" d="M5 12L21 2" />`}
    </svg>
  `;
}

/** Voltage and charge; below them what to think of that, and where it comes from. */
export function Battery({ car }) {
  if (batteryState(car) === "none") return html`not measured`;
  const word = batteryWord(car);
  return html`
    <span class="charge" data-battery=${batteryState(car)}>
      <${BatterySign} car=${car} />
      ${fixed(car.battery_v, 2, " V")}${car.battery_charge === null ? "" : `, ${percent(car)}`}
    </span>
    <small class="how">${word && html`<b class="charge" data-battery=${batteryState(car)}>${word}</b>, `}${source(car)}</small>
  `;
}

/** The charge in whole percent, never rounded up to what it is not. */
export function percent(car) {
  return car.battery_charge === null ? "" : `${Math.floor(100 * car.battery_charge)} %`;
}
