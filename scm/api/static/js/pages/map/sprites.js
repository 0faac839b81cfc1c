/** Cars as little pictures made once for each kind, car file and size: a thousand of them are quick to draw. */
import { drawBody, footprint, paintOf, signOf } from "scm/shared/car_shape.js";

const LEAST_PX = 13; // shorter cars could not be seen, nor their heading
const SIMPLE_PX = 24; // shorter ones get no windows
const STEP = 1.15; // sizes between are drawn scaled
const RIM_PX = 2;

const made = new Map();

/** @returns `{canvas, scale, x, y}`: the picture, its pixels a metre, and the origin in it. */
function spriteOf(car, kind, alive, px_per_m) {
  const shape = footprint(car);
  const length = shape.front - shape.rear;
  const least = LEAST_PX / length;
  const scale = STEP ** Math.round(Math.log(Math.max(px_per_m, least)) / Math.log(STEP));
  const key = `${car}/${alive ? kind : "lost"}/${scale}`;
  let sprite = made.get(key);
  if (!sprite) made.set(key, (sprite = make(shape, kind, alive, scale)));
  return sprite;
}

function make(shape, kind, alive, scale) {
  const { rear, front, half } = shape;
  const canvas = document.createElement("canvas");
  canvas.width = Math.ceil((front - rear) * scale + 2 * RIM_PX);
  canvas.height = Math.ceil(2 * half * scale + 2 * RIM_PX);
  const paper = canvas.getContext("2d");
  const [x, y] = [RIM_PX - rear * scale, canvas.height / 2];
  paper.setTransform(scale, 0, 0, -scale, x, y);
  const simple = (front - rear) * scale < SIMPLE_PX;
  if (simple) arrow(paper, shape, kind, alive, scale);
  else drawBody(paper, shape, paintOf(kind, alive), alive ? kind : "lost");
  return { canvas, scale, x, y };
}

/** A small car: a body that is pointed where it drives, with the sign of its kind. */
function arrow(paper, { rear, front, half }, kind, alive, scale) {
  const [light] = paintOf(kind, alive);
  paper.beginPath();
  paper.moveTo(front, 0);
  paper.lineTo(front - 1.1 * half, half);
  paper.lineTo(rear, half);
  paper.lineTo(rear, -half);
  paper.lineTo(front - 1.1 * half, -half);
  paper.closePath();
  paper.fillStyle = light;
  paper.fill();
  paper.lineWidth = 1 / scale;
  paper.strokeStyle = "rgba(8, 12, 18, 0.85)";
  paper.stroke();
  paper.beginPath();
  paper.fillStyle = "#ffffff";
  signOf(paper, alive ? kind : "lost", rear + 0.36 * (front - rear), 0, 0.5 * half);
  paper.fill();
}

/** Draw the cars in these rows of the fleet where the glide has them. */
export function drawSprites(paper, view, ratio, fleet, glide, rows) {
  const base = paper.getTransform();
  for (const row of rows) {
    const { car, kind } = fleet.vehicles[row];
    const sprite = spriteOf(car, kind, (fleet.flags[row] & 1) === 1, view.scale * ratio);
    const shape = footprint(car);
    const shown = Math.max(view.scale * ratio, LEAST_PX / (shape.front - shape.rear));
    const k = shown / sprite.scale;
    const [c, s] = [k * Math.cos(glide.yaw[row]), k * Math.sin(glide.yaw[row])];
    const [x, y] = [view.x(glide.x[row]) * ratio, view.y(glide.y[row]) * ratio];
    paper.setTransform(c, -s, s, c, x - c * sprite.x - s * sprite.y, y + s * sprite.x - c * sprite.y);
    paper.drawImage(sprite.canvas, 0, 0);
  }
  paper.setTransform(base);
}
