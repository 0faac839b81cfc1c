/**
 * Cars as little pictures made once for each look and size: a thousand of them are quick to draw.
 *
 * Small ones are stamps: made for every heading and half pixel that is needed, and copied to whole pixels.
 * Without a graphics card a copy costs a third of turning a picture, and at this size nobody sees the steps.
 */
import { drawBody, footprint, paintOf, signOf } from "scm/shared/car_shape.js";

const LEAST_PX = 13; // shorter cars could not be seen, nor their heading
const SIMPLE_PX = 24; // shorter ones get no windows, and are stamped
const STEP = 1.15; // sizes between are drawn scaled; of stamps, in the size nearest
const RIM_PX = 2;
const HEADINGS = 72; // the nose of a stamp is at most half a pixel off
const MOST_STAMPS = 6000; // of all sizes; a few megabytes
const TURN = 2 * Math.PI;

const looks = new Map();
let stamps = 0;

/** Draw the cars in these rows of the fleet where the glide has them; `ratio` is device pixels a pixel. */
export function drawSprites(paper, view, ratio, fleet, glide, rows) {
  const base = paper.getTransform();
  const px_per_m = view.scale * ratio;
  const sizes = new Map();
  paper.setTransform(1, 0, 0, 1, 0, 0);
  for (const row of rows) {
    const { car, kind } = fleet.vehicles[row];
    let size = sizes.get(car);
    if (!size) sizes.set(car, (size = sizeOf(car, px_per_m, ratio)));
    const look = lookOf(size, (fleet.flags[row] & 1) === 1 ? kind : "lost");
    const [c, s] = [Math.cos(glide.yaw[row]), Math.sin(glide.yaw[row])];
    const { middle } = size.shape;
    const x = view.x(glide.x[row] + middle * c) * ratio;
    const y = view.y(glide.y[row] + middle * s) * ratio;
    if (size.small) stamp(paper, look, x, y, glide.yaw[row]);
    else turn(paper, look, x, y, size.grown * c, size.grown * s);
  }
  paper.setTransform(base);
}

/** How large cars of a file are drawn: `scale` [device px/m] of their pictures, and `grown` times that. */
function sizeOf(car, px_per_m, ratio) {
  const shape = footprint(car);
  const length = shape.front - shape.rear;
  const shown = Math.max(px_per_m, (LEAST_PX * ratio) / length);
  const scale = STEP ** Math.round(Math.log(shown) / Math.log(STEP));
  return { shape, scale, grown: shown / scale, small: length * scale < SIMPLE_PX * ratio, looks: new Map() };
}

/** Pictures of a car of this size and kind; made on first use. */
function lookOf(size, kind) {
  let look = size.looks.get(kind);
  if (look) return look;
  const { rear, front, half } = size.shape;
  const key = [rear, front, half, size.scale, size.small, kind].join("/");
  look = looks.get(key);
  if (!look) looks.set(key, (look = { ...size, kind, stamps: [], picture: null }));
  size.looks.set(kind, look);
  return look;
}

/** Copy the stamp that is nearest in heading and half pixel. */
function stamp(paper, look, x, y, yaw) {
  const [across, down] = [Math.round(2 * x), Math.round(2 * y)];
  const heading = ((Math.round((yaw / TURN) * HEADINGS) % HEADINGS) + HEADINGS) % HEADINGS;
  const number = 4 * heading + 2 * (across & 1) + (down & 1);
  let picture = look.stamps[number];
  if (!picture) picture = look.stamps[number] = press(look, heading, (across & 1) / 2, (down & 1) / 2);
  paper.drawImage(picture, (across >> 1) - picture.width / 2, (down >> 1) - picture.height / 2);
}

/** A stamp, its middle `right` and `below` of the middle of its picture [px]. */
function press(look, heading, right, below) {
  if (++stamps > MOST_STAMPS) forget();
  const { front, rear, half } = look.shape;
  const reach = Math.ceil((look.scale * Math.hypot(front - rear, 2 * half)) / 2 + RIM_PX);
  const sheet = new OffscreenCanvas(2 * reach, 2 * reach);
  const paper = sheet.getContext("2d");
  paper.translate(reach + right, reach + below);
  paper.rotate(-(heading / HEADINGS) * TURN);
  paint(paper, look);
  return sheet.transferToImageBitmap();
}

/** Start anew with stamps, since many sizes were looked at; the one in the making is the first. */
function forget() {
  for (const look of looks.values()) {
    look.stamps.forEach((picture) => picture.close());
    look.stamps = [];
  }
  stamps = 1;
}

/** Draw a larger car turned by the matrix (c, s). */
function turn(paper, look, x, y, c, s) {
  const picture = (look.picture ??= lying(look));
  const [dx, dy] = [picture.width / 2, picture.height / 2];
  paper.setTransform(c, -s, s, c, x - c * dx - s * dy, y + s * dx - c * dy);
  paper.drawImage(picture, 0, 0);
}

/** A car along its picture. */
function lying(look) {
  const { front, rear, half } = look.shape;
  const wide = Math.ceil((front - rear) * look.scale + 2 * RIM_PX);
  const sheet = new OffscreenCanvas(wide, Math.ceil(2 * half * look.scale + 2 * RIM_PX));
  const paper = sheet.getContext("2d");
  paper.translate(sheet.width / 2, sheet.height / 2);
  paint(paper, look);
  return sheet.transferToImageBitmap();
}

/** The car about its middle. */
function paint(paper, { shape, kind, scale, small }) {
  paper.scale(scale, -scale);
  paper.translate(-shape.middle, 0);
  if (small) arrow(paper, shape, kind, scale);
  else drawBody(paper, shape, paintOf(kind, kind !== "lost"), kind);
}

/** A small car: a body that is pointed where it drives, with the sign of its kind. */
function arrow(paper, { rear, front, half }, kind, scale) {
  const [light] = paintOf(kind, kind !== "lost");
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
  signOf(paper, kind, rear + 0.36 * (front - rear), 0, 0.5 * half);
  paper.fill();
}
