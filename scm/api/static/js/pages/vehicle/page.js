/** The vehicle page: `/vehicles` lists all, `/vehicles/n1` shows one. */
import { html } from "scm/shared/html.js";
import { route } from "scm/shell/router.js";
import { useTopics, world } from "scm/shell/store.js";
import { CloseUp } from "scm/pages/vehicle/close_up.js";
import { FleetTable } from "scm/pages/vehicle/fleet_table.js";

export function Page() {
  useTopics("vehicles", "autonomy", "twins");
  const name = route.value.rest;
  if (!name) return html`<${FleetTable} />`;
  const car = world.value.vehicles.find((one) => one.vehicle === name);
  if (car) return html`<${CloseUp} key=${name} car=${car} />`;
  const known = world.value.tick !== null;
  return html`
    <section class="panel nobody" aria-label="Vehicle ${name}">
      <h2>${known ? `No vehicle named ${name} is in the city` : "Waiting for the city"}</h2>
      ${known && html`<p class="empty">It may have left. <a href="/vehicles">All vehicles</a></p>`}
    </section>
  `;
}
