/** One vehicle: what it sees, its commands and its response, who drives it, and teleoperation. */
import { modeOf, stuckBy } from "scm/shared/condition.js";
import { html } from "scm/shared/html.js";
import { go } from "scm/shell/router.js";
import { world } from "scm/shell/store.js";
import { byName, fixed } from "scm/shared/format.js";
import { batteryState, batteryWord, BatterySign } from "scm/pages/vehicle/battery.js";
import { CameraPanel } from "scm/pages/vehicle/camera_panel.js";
import { FactsPanel } from "scm/pages/vehicle/facts_panel.js";
import { LidarPanel } from "scm/pages/vehicle/lidar_panel.js";
import { LightsPanel } from "scm/pages/vehicle/lights_panel.js";
import { PlotsPanel } from "scm/pages/vehicle/plots_panel.js";
import { useReports } from "scm/pages/vehicle/reports.js";
import { WheelPanel } from "scm/pages/vehicle/wheel_panel.js";

const STALE_MS = 500;

export function CloseUp({ car }) {
  useReports(car.vehicle);
  const mode = modeOf(car);
  return html`
    <header class="who moves" data-stale=${car.age_ms > STALE_MS}>
      <a href="/vehicles">All vehicles</a>
      <label>
        <span class="hidden">Vehicle</span>
        <select aria-label="Vehicle" value=${car.vehicle} onChange=${(event) => go(`/vehicles/${event.target.value}`)}>
          ${world.value.vehicles
            .map((one) => one.vehicle)
            .toSorted(byName)
            .map((name) => html`<option value=${name} selected=${name === car.vehicle}>${name}</option>`)}
        </select>
      </label>
      <span class="kind" data-kind=${car.kind}>${car.kind}</span>
      <span>${car.car}, tag ${car.tag_id}</span>
      <span class="mode" data-mode=${mode} title=${stuckBy(car)}>${mode}</span>
      ${batteryWord(car) && html`<span class="charge" data-battery=${batteryState(car)}><${BatterySign} car=${car} /> battery ${batteryWord(car)}</span>`}
      <span class="speed"><b>${fixed(car.speed_mps, 2)}</b> m/s</span>
    </header>
    <${CameraPanel} car=${car} />
    <${LidarPanel} car=${car} />
    <${PlotsPanel} />
    <div class="side">
      <${WheelPanel} car=${car} />
      <${FactsPanel} car=${car} />
      <${LightsPanel} car=${car} />
    </div>
  `;
}
