/** The map page: the map, and beside it all cars, the chosen one, the signals and the stations. */
import { useEffect } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { selected } from "scm/shared/selection.js";
import { route } from "scm/shell/router.js";
import { useTopics } from "scm/shell/store.js";
import { ChosenVehicle } from "scm/pages/map/chosen_vehicle.js";
import { useFleet } from "scm/pages/map/fleet.js";
import { MapPanel } from "scm/pages/map/map_panel.js";
import { SignalsShort } from "scm/pages/map/signals_short.js";
import { StationsPanel } from "scm/pages/map/stations_panel.js";
import { VehicleTable } from "scm/pages/map/vehicle_table.js";

export function Page() {
  useTopics("signals", "boxes", "stations", "autonomy", "room_maps", "twins");
  useFleet();
  const requested = route.value.query.vehicle; // `/map?vehicle=n1` shows that car
  useEffect(() => void (requested && (selected.value = requested)), [requested]);
  return html`
    <${MapPanel} />
    <aside aria-label="Vehicles, signals and stations">
      <${VehicleTable} />
      <${ChosenVehicle} />
      <${SignalsShort} />
      <${StationsPanel} />
    </aside>
  `;
}
