/** Calibrating a camera in steps: its lens by a printed board, its place by tags on the floor, the saved calibrations. */
import { useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { useFetched } from "scm/shared/fetched.js";
import { PutInForce } from "scm/pages/eye/in_force.js";
import { LensStep } from "scm/pages/eye/lens_step.js";
import { PlaceStep } from "scm/pages/eye/place_step.js";
import { Calibrations } from "scm/pages/eye/calibrations.js";

export function Wizard({ camera }) {
  const [choice, setChoice] = useState(); // a calibration's name; null: the one before; undefined: none
  const calibrations = useFetched("/eye/calibrations?limit=200", 5000);
  if (calibrations.error && calibrations.body === null) {
    return html`<section class="panel wide" aria-label="Calibrate"><p class="empty" role="alert">${calibrations.error}</p></section>`;
  }
  const saved = calibrations.body?.items ?? [];
  const lenses = saved.filter((one) => one.kind === "lens" && one.width_px === camera.width_px && one.height_px === camera.height_px);
  return html`
    <${LensStep} camera=${camera} saved=${saved} done=${calibrations.again} put=${setChoice} />
    <${PlaceStep} camera=${camera} saved=${saved} lenses=${lenses} done=${calibrations.again} put=${setChoice} />
    <${Calibrations} camera=${camera} saved=${saved} known=${calibrations.body !== null} changed=${calibrations.again} put=${setChoice} />
    ${choice !== undefined && html`<${PutInForce} camera=${camera} choice=${choice} close=${() => setChoice(undefined)} />`}
  `;
}
