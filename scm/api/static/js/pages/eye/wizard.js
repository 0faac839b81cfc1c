/** Calibrating a camera in steps: its lens by a printed board, its place by tags on the floor, the shelf. */
import { useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { usePolled } from "scm/pages/eye/asking.js";
import { PutInForce } from "scm/pages/eye/in_force.js";
import { LensStep } from "scm/pages/eye/lens_step.js";
import { PlaceStep } from "scm/pages/eye/place_step.js";
import { Shelf } from "scm/pages/eye/shelf.js";

export function Wizard({ camera }) {
  const [wish, setWish] = useState(); // a calibration's name; null: the one before; undefined: none
  const shelf = usePolled("/eye/calibrations?limit=200", 5000);
  if (shelf.error && shelf.body === null) {
    return html`<section class="panel wide" aria-label="Calibrate"><p class="empty" role="alert">${shelf.error}</p></section>`;
  }
  const kept = shelf.body?.items ?? [];
  const lenses = kept.filter((one) => one.kind === "lens" && one.width_px === camera.width_px && one.height_px === camera.height_px);
  return html`
    <${LensStep} camera=${camera} kept=${kept} done=${shelf.again} put=${setWish} />
    <${PlaceStep} camera=${camera} kept=${kept} lenses=${lenses} done=${shelf.again} put=${setWish} />
    <${Shelf} camera=${camera} kept=${kept} known=${shelf.body !== null} changed=${shelf.again} put=${setWish} />
    ${wish !== undefined && html`<${PutInForce} camera=${camera} wish=${wish} close=${() => setWish(undefined)} />`}
  `;
}
