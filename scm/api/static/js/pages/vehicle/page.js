/** The vehicle page: `/vehicles` lists all, `/vehicles/n1` shows one. */
import { html } from "scm/shared/html.js";
import { route } from "scm/shell/router.js";
import { useTopics, world } from "scm/shell/store.js";
import { CarPanel } from "scm/pages/vehicle/car_panel.js";

export function Page() {
  useTopics("vehicles");
  const car = world.value.vehicles.find((one) => one.vehicle === route.value.rest);
  if (car) return html`<${CarPanel} car=${car} />`;
  return html`
    <section class="panel" aria-label="Vehicles">
      <ul>
        ${world.value.vehicles.map(
          (one) => html`<li key=${one.vehicle}><a href="/vehicles/${one.vehicle}">${one.vehicle}</a></li>`,
        )}
      </ul>
    </section>
  `;
}
