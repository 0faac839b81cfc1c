/** What a car's LIDAR sees, from above: the car looks up, rings every half metre. Received while it is shown. */
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { fixed } from "scm/shared/format.js";
import { footprint } from "scm/shared/car_shape.js";
import { useOld } from "scm/shell/store.js";
import { colours } from "scm/shell/theme.js";
import { scan, scannedAt } from "scm/pages/vehicle/reports.js";

const REACHES_M = [1, 2, 4, 8];

export function LidarPanel({ car }) {
  const canvas = useRef(null);
  const [reach, setReach] = useState(2);
  const late = useOld(scannedAt);
  const newest = scan.value;
  useEffect(() => {
    if (newest && canvas.current) draw(canvas.current, newest, car.car, reach);
  }, [newest, reach, colours.value]);
  const beams = newest ? newest.ranges_m.length : 0;
  const nearest = newest ? newest.ranges_m.reduce((least, range) => (range === null ? least : Math.min(least ?? range, range)), null) : null;
  return html`
    <section class="panel lidar" aria-label="LIDAR">
      <div class="panel-head">
        <h2>LIDAR ${newest && html`<small>nearest ${fixed(nearest, 2, " m")}</small>`}</h2>
        ${newest !== false &&
        html`
          <div class="choices" role="group" aria-label="Reach">
            ${REACHES_M.map(
              (metres) => html`<button class="small" aria-pressed=${reach === metres} onClick=${() => setReach(metres)}>${metres} m</button>`,
            )}
          </div>
        `}
      </div>
      ${!newest
        ? html`<p class="empty">${newest === false ? "This car has no LIDAR." : "Waiting for a scan."}</p>`
        : html`<canvas ref=${canvas} class="moves" data-stale=${late} role="img" aria-label="Scan from above: ${beams} beams, the nearest thing at ${fixed(nearest, 2)} m"></canvas>`}
    </section>
  `;
}

function draw(canvas, scan, carFile, reach) {
  if (!canvas) return; // nothing to draw on yet, or no longer
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const paper = canvas.getContext("2d");
  const style = getComputedStyle(canvas);
  const scale = (Math.min(width, height) / 2 - 6) / reach;
  paper.setTransform(ratio * scale, 0, 0, ratio * scale, (ratio * width) / 2, (ratio * height) / 2);
  rings(paper, reach, scale, style.color);
  // From here on: x is forward and up on the screen, y is left.
  paper.transform(0, -1, -1, 0, 0, 0);
  points(paper, scan, reach, scale, style);
  outline(paper, carFile, scale);
}

function rings(paper, reach, scale, ink) {
  paper.lineWidth = 1 / scale;
  paper.strokeStyle = ink;
  paper.fillStyle = ink;
  paper.font = `${11 / scale}px system-ui, sans-serif`;
  const step = reach / 4;
  for (let k = 1; k <= 4; k++) {
    paper.globalAlpha = 0.28;
    paper.beginPath();
    paper.arc(0, 0, k * step, 0, 2 * Math.PI);
    paper.stroke();
    paper.globalAlpha = 1;
    paper.fillText(`${k * step} m`, 4 / scale, -k * step + 12 / scale);
  }
}

function points(paper, scan, reach, scale, style) {
  const size = 2.2 / scale;
  paper.fillStyle = style.accentColor;
  scan.ranges_m.forEach((range, i) => {
    if (range === null || range > reach * 1.5) return;
    const bearing = scan.bearing_first_rad + i * scan.bearing_step_rad;
    const x = scan.scanner_x_m + range * Math.cos(bearing);
    const y = scan.scanner_y_m + range * Math.sin(bearing);
    paper.beginPath();
    paper.arc(x, y, size, 0, 2 * Math.PI);
    paper.fill();
  });
}

function outline(paper, carFile, scale) {
  const { rear, front, half } = footprint(carFile);
  paper.beginPath();
  paper.moveTo(front, 0);
  paper.lineTo(front - 0.06, half);
  paper.lineTo(rear, half);
  paper.lineTo(rear, -half);
  paper.lineTo(front - 0.06, -half);
  paper.closePath();
  paper.globalAlpha = 0.35;
  paper.fill();
  paper.globalAlpha = 1;
  paper.lineWidth = 1.5 / scale;
  paper.strokeStyle = paper.fillStyle;
  paper.stroke();
}
