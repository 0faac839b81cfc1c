/** Where a drive would lead from where a car is now, on the city's floor with everybody on it. */
import { html } from "scm/shared/html.js";
import { footprint } from "scm/shared/car_shape.js";
import { useWidth } from "scm/pages/mismatch/plot.js";

/** A way laid so that it begins where the car is: `[x, y]` on the floor [m]. */
export function laidFrom(way, car) {
  if (!way.length || !car) return [];
  const [x0, y0, yaw0] = way[0];
  const turn = car.yaw_rad - yaw0;
  const [c, s] = [Math.cos(turn), Math.sin(turn)];
  return way.map(([x, y]) => [
    car.x_m + c * (x - x0) - s * (y - y0),
    car.y_m + s * (x - x0) + c * (y - y0),
  ]);
}

/** Whether a drive from where the car is would come too near to the floor's edge. */
export function leavesFloor(way, car, floor) {
  if (!floor || !car) return false;
  const margin = footprint(car.car).front;
  const inside = (value, [low, high]) => value >= low + margin && value <= high - margin;
  return laidFrom(way, car).some(([x, y]) => !inside(x, floor.x_m) || !inside(y, floor.y_m));
}

export function DriveFloor(known) {
  return known.way.length && known.floor && known.car ? html`<${Laid} ...${known} />` : null;
}

function Laid({ way, car, cars, floor }) {
  const [ref, width] = useWidth();
  const laid = laidFrom(way, car);
  const [x0, x1] = shown(floor.x_m, laid.map(([x]) => x));
  const [y0, y1] = shown(floor.y_m, laid.map(([, y]) => y));
  const per_m = Math.min((width - 16) / (x1 - x0), 240 / (y1 - y0));
  const height = per_m * (y1 - y0) + 16;
  const left = (width - per_m * (x1 - x0)) / 2;
  const x = (value) => left + (value - x0) * per_m;
  const y = (value) => 8 + (y1 - value) * per_m;
  const data = laid.map(([px, py], i) => `${i ? "L" : "M"}${x(px).toFixed(1)} ${y(py).toFixed(1)}`).join("");
  return html`
    <figure ref=${ref}>
      <svg class="drive-floor" width=${width} height=${height} role="img" aria-label="Where the drive leads from where ${car.vehicle} is">
        <rect
          class="ground"
          x=${x(floor.x_m[0])}
          y=${y(floor.y_m[1])}
          width=${(floor.x_m[1] - floor.x_m[0]) * per_m}
          height=${(floor.y_m[1] - floor.y_m[0]) * per_m}
          rx="4"
        />
        <path class="curve plan" d=${data} />
        ${cars.map((one) => html`<${Body} key=${one.vehicle} car=${one} is=${one === car} x=${x} y=${y} per_m=${per_m} />`)}
      </svg>
      <figcaption class="hint">Dashed: where the drive would lead ${car.vehicle} from where it is now.</figcaption>
    </figure>
  `;
}

/** What is shown of an axis: the floor, and enough of what leads off it to show the direction. */
function shown([low, high], values) {
  const beyond = 0.3 * (high - low);
  return [
    Math.max(low - beyond, Math.min(low, ...values) - 0.1),
    Math.min(high + beyond, Math.max(high, ...values) + 0.1),
  ];
}

function Body({ car, is, x, y, per_m }) {
  const { rear, front, half } = footprint(car.car);
  const place = `translate(${x(car.x_m)} ${y(car.y_m)}) rotate(${(-car.yaw_rad * 180) / Math.PI})`;
  return html`
    <rect
      class="car ${is ? "chosen" : ""}"
      transform=${place}
      x=${rear * per_m}
      y=${-half * per_m}
      width=${(front - rear) * per_m}
      height=${2 * half * per_m}
      rx="3"
    />
  `;
}
