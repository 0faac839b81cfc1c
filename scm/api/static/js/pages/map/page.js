/** The map page: the map, and beside it the cars and the stations. */
import { html } from "scm/shared/html.js";
import { useTopics } from "scm/shell/store.js";
import { CarsTable } from "scm/pages/map/cars_table.js";
import { MapPanel } from "scm/pages/map/map_panel.js";
import { StationsPanel } from "scm/pages/map/stations_panel.js";

export function Page() {
  useTopics("vehicles", "signals", "boxes", "stations");
  return html`
    <${MapPanel} />
    <${CarsTable} />
    <${StationsPanel} />
  `;
}
