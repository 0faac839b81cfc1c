/** A car from above at its size beside a Nigel, on the tightest circle that it can turn. */
import { useEffect, useRef } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { drawBody, drawWheels, footprint, outlineOf, paintOf } from "scm/shared/car_shape.js";

const HEIGHT_PX = 300;
const MARGIN_M = 0.1;
const LEAST_WIDTH_M = 1.2;

export function SeenFromAbove({ row }) {
  const canvas = useRef(null);
  useEffect(() => {
    const draw = () => paint(canvas.current, outlineOf(row), row.turning_radius_m);
    const watch = new ResizeObserver(draw);
    watch.observe(canvas.current);
    draw();
    return () => watch.disconnect();
  }, [row]);
  const [wide, long] = [100 * (row.left_m - row.right_m), 100 * (row.front_m - row.rear_m)];
  const words = `${long.toFixed(0)} by ${wide.toFixed(0)} cm, turns on a radius of ${row.turning_radius_m.toFixed(2)} m`;
  return html`
    <figure class="above">
      <canvas ref=${canvas} style="height: ${HEIGHT_PX}px" role="img" aria-label="The car from above: ${words}"></canvas>
      <figcaption class="hint">${words} (rear axle). Dashed: the tightest circle, and what the car sweeps on it. Grey: a Nigel.</figcaption>
    </figure>
  `;
}

/** The car stands at the origin and turns left; what it sweeps lies between two circles about the centre of the turn. */
function paint(canvas, shape, radius) {
  const ratio = devicePixelRatio;
  const [width, height] = [canvas.clientWidth * ratio, HEIGHT_PX * ratio];
  [canvas.width, canvas.height] = [width, height];
  const paper = canvas.getContext("2d");
  const muted = getComputedStyle(canvas).getPropertyValue("color");
  const outer = Math.hypot(radius + shape.half, Math.max(shape.front, -shape.rear));
  const inner = Math.max(0, radius - shape.half);
  const nigel = footprint("nigel");
  const low = -shape.half - 2 * nigel.half - 2 * MARGIN_M;
  const [across, up] = [Math.max(2 * outer, LEAST_WIDTH_M) + 2 * MARGIN_M, radius + outer + MARGIN_M - Math.min(low, radius - outer)];
  const scale = Math.min(width / across, height / up);
  paper.translate(width / 2, height - scale * (MARGIN_M / 2 - Math.min(low, radius - outer)));
  paper.scale(scale, -scale);
  paper.setLineDash([5 * ratio / scale, 5 * ratio / scale]);
  paper.lineWidth = ratio / scale;
  paper.strokeStyle = muted;
  for (const [around, faint] of [[radius, 1], [outer, 0.5], [inner, 0.5]]) {
    paper.globalAlpha = faint;
    paper.beginPath();
    paper.arc(0, radius, around, 0, 2 * Math.PI);
    paper.stroke();
  }
  paper.globalAlpha = 1;
  paper.setLineDash([]);
  drawWheels(paper, shape, Math.atan2(shape.wheelbase, radius));
  drawBody(paper, shape, paintOf("remote", true), "remote");
  paper.translate(0, -shape.half - nigel.half - MARGIN_M);
  drawWheels(paper, nigel, 0);
  drawBody(paper, nigel, paintOf("lost", false), "hosted");
  ruler(paper, { width, height, ratio, scale, muted });
}

/** A bar of 10 cm or 1 m at the lower left. */
function ruler(paper, { width, height, ratio, scale, muted }) {
  const [length, words] = scale * 0.1 > 30 * ratio ? [0.1, "10 cm"] : [1, "1 m"];
  paper.setTransform(1, 0, 0, 1, 0, 0);
  paper.fillStyle = muted;
  paper.fillRect(8 * ratio, height - 8 * ratio, Math.min(length * scale, width / 2), 2 * ratio);
  paper.font = `${12 * ratio}px system-ui, sans-serif`;
  paper.fillText(words, 8 * ratio, height - 14 * ratio);
}
