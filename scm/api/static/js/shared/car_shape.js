/**
 * A car seen from above, drawn in metres with the rear axle's centre as origin, x forward, y left.
 *
 * Colour and the sign on its roof show its kind: circle hosted, diamond remote, triangle real.
 */
/** Outlines by car file [m]: a Nigel's until the city's are read. */
const NIGEL = { rear: -0.07, front: 0.23, half: 0.0875, wheelbase: 0.14154, track: 0.153, radius: 0.0325, middle: 0.08 };
const outlines = new Map([["nigel", NIGEL]]);
const SMALL_PX_PER_M = 130; // below, names are written smaller
const PAINT = {
  hosted: ["#4c8df0", "#2c65bd"],
  remote: ["#a97bf2", "#7647c2"],
  real: ["#f0a13c", "#b9711a"],
  lost: ["#8a929c", "#5c636c"],
};

/** Corners of the signs that are no circle. */
const SIGNS = {
  remote: [[1.1, 0], [0, 1], [-1.1, 0], [0, -1]],
  real: [[1.1, 0], [-0.75, 1], [-0.75, -1]],
};

/** The two colours of a car of this kind, light and dark; a lost one is grey. */
export const paintOf = (kind, alive) => (alive ? (PAINT[kind] ?? PAINT.hosted) : PAINT.lost);

/** Rear and front end, half width, wheelbase, track, radius of the wheels, and the middle [m]. */
export function footprint(car) {
  if (!outlines.has(car)) learn(car);
  return outlines.get(car);
}

/** Read car files from the city; an unknown one is drawn as a Nigel. */
async function learn(car) {
  outlines.set(car, NIGEL);
  const { placed } = await import("scm/shared/base.js"); // it needs a document, and to draw needs none
  const reply = await fetch(placed("/api/v1/cars")).catch(() => null);
  const { cars } = reply?.ok ? await reply.json() : { cars: [] };
  for (const row of cars) if (!row.problem) outlines.set(row.car, outlineOf(row));
}

/** The outline of a row of `GET /cars`. */
export function outlineOf(row) {
  return {
    rear: row.rear_m,
    front: row.front_m,
    half: (row.left_m - row.right_m) / 2,
    wheelbase: row.wheelbase_m,
    track: row.track_m,
    radius: row.wheel_radius_m,
    middle: (row.rear_m + row.front_m) / 2,
  };
}

/** Draw a car; a chosen or lost one always with its name, others when there is room: `named`. */
export function drawCar(paper, view, car, chosen, named = true, heads = []) {
  const shape = footprint(car.car);
  const paint = paintOf(car.kind, car.alive);
  paper.save();
  paper.translate(view.x(car.x_m), view.y(car.y_m));
  paper.rotate(-car.yaw_rad);
  paper.scale(view.scale, -view.scale);
  const on = new Set(car.alive ? car.lights : []);
  beams(paper, shape, on);
  if (chosen) drawHalo(paper, shape);
  drawWheels(paper, shape, car.steering_rad);
  drawBody(paper, shape, paint, car.alive ? car.kind : "lost");
  lamps(paper, shape, on);
  if (!car.alive) cross(paper, shape);
  paper.restore();
  if (named || chosen || !car.alive) drawLabel(paper, view, car, chosen, heads);
}

/** The ring about a chosen car. */
export function drawHalo(paper, { rear, front, half }) {
  paper.beginPath();
  paper.roundRect(rear - 0.03, -half - 0.03, front - rear + 0.06, 2 * half + 0.06, 0.06);
  paper.lineWidth = 0.009;
  paper.strokeStyle = "#ffffff";
  paper.stroke();
}

export function drawWheels(paper, { track, wheelbase, radius }, steering) {
  paper.fillStyle = "#0c0f13";
  for (const [x, angle] of [[0, 0], [wheelbase, steering]]) {
    for (const y of [-track / 2, track / 2]) {
      paper.save();
      paper.translate(x, y);
      paper.rotate(angle);
      paper.beginPath();
      paper.roundRect(-radius, -0.45 * radius, 2 * radius, 0.9 * radius, 0.25 * radius);
      paper.fill();
      paper.restore();
    }
  }
}

/** The body with its windows and the sign of its kind, in metres. */
export function drawBody(paper, { rear, front, half }, [light, dark], kind) {
  const wide = half - 0.019;
  paper.beginPath();
  paper.roundRect(rear, -wide, front - rear, 2 * wide, [0.03, 0.03, 0.05, 0.05].reverse());
  const shade = paper.createLinearGradient(0, wide, 0, -wide);
  shade.addColorStop(0, light);
  shade.addColorStop(1, dark);
  paper.fillStyle = shade;
  paper.fill();
  paper.lineWidth = 0.004;
  paper.strokeStyle = "rgba(8, 12, 18, 0.75)";
  paper.stroke();
  const length = front - rear;
  paper.fillStyle = "rgba(10, 16, 24, 0.72)";
  pane(paper, rear + 0.62 * length, rear + 0.76 * length, 0.62 * wide, 0.82 * wide);
  pane(paper, rear + 0.24 * length, rear + 0.15 * length, 0.62 * wide, 0.76 * wide);
  paper.fillStyle = "#ffffff";
  paper.beginPath();
  signOf(paper, kind, rear + 0.44 * length, 0, 0.42 * wide);
  paper.fill();
}

/** The outline of a kind's sign about (x, y); points forward. */
export function signOf(paper, kind, x, y, size) {
  const corners = SIGNS[kind];
  if (!corners) paper.arc(x, y, 0.85 * size, 0, 2 * Math.PI);
  else {
    corners.forEach(([along, across], i) => paper[i ? "lineTo" : "moveTo"](x + along * size, y + across * size));
    paper.closePath();
  }
}

/** A windscreen: a trapezium from x0 (narrow) to x1 (wide). */
function pane(paper, x0, x1, half0, half1) {
  paper.beginPath();
  paper.moveTo(x0, -half0);
  paper.lineTo(x1, -half1);
  paper.lineTo(x1, half1);
  paper.lineTo(x0, half0);
  paper.closePath();
  paper.fill();
}

/** What the headlights throw on the road: the high beam reaches farther. */
function beams(paper, { front, half }, on) {
  if (!on.has("head_low")) return;
  const reach = on.has("head_high") ? 0.42 : 0.24;
  const light = paper.createLinearGradient(front, 0, front + reach, 0);
  light.addColorStop(0, "rgba(255, 244, 190, 0.5)");
  light.addColorStop(1, "rgba(255, 244, 190, 0)");
  paper.fillStyle = light;
  paper.beginPath();
  paper.moveTo(front - 0.01, half - 0.02);
  paper.lineTo(front + reach, half + 0.3 * reach);
  paper.lineTo(front + reach, -half - 0.3 * reach);
  paper.lineTo(front - 0.01, 0.02 - half);
  paper.closePath();
  paper.fill();
}

function lamps(paper, { rear, front, half }, on) {
  const side = half - 0.034;
  const head = on.has("head_low");
  const pair = (x, colour, size) => {
    paper.fillStyle = colour;
    for (const y of [-side, side]) dot(paper, x, y, size);
  };
  pair(front - 0.012, head ? "#fff6cf" : "rgba(255, 255, 255, 0.4)", 0.011);
  pair(rear + 0.011, on.has("brake") ? "#ff3b30" : on.has("tail") ? "#b3312b" : "#64201f", 0.011);
  if (on.has("reverse")) dot(paper, rear + 0.01, 0, 0.009, "#ffffff");
  for (const [name, y] of [["left", half - 0.016], ["right", 0.016 - half]]) {
    if (!on.has(name)) continue;
    for (const x of [rear + 0.02, front - 0.03]) dot(paper, x, y, 0.011, "#ffb02e");
  }
}

function dot(paper, x, y, radius, colour) {
  if (colour) paper.fillStyle = colour;
  paper.beginPath();
  paper.arc(x, y, radius, 0, 2 * Math.PI);
  paper.fill();
}

function cross(paper, { rear, front, half }) {
  paper.beginPath();
  paper.moveTo(rear, -half);
  paper.lineTo(front, half);
  paper.moveTo(rear, half);
  paper.lineTo(front, -half);
  paper.lineWidth = 0.014;
  paper.lineCap = "round";
  paper.strokeStyle = "#ff5a55";
  paper.stroke();
}

/**
 * The name beside the car, outside its outline whatever its heading, where no signal head would hide it.
 * @param heads signal heads, drawn over names: `[left, top, right, bottom]` in pixels
 */
export function drawLabel(paper, view, car, chosen, heads = []) {
  const { middle, front, rear, half } = footprint(car.car);
  const [colour] = paintOf(car.kind, car.alive);
  const [c, s] = [Math.cos(car.yaw_rad), Math.sin(car.yaw_rad)];
  const small = view.scale < SMALL_PX_PER_M;
  paper.font = `600 ${small ? 10 : 12}px system-ui, sans-serif`;
  paper.textAlign = "left";
  paper.textBaseline = "middle";
  const text = car.alive ? car.vehicle : `${car.vehicle} lost`;
  const lead = small ? 5 : 17; // the dot stands before the name where there is room
  const width = paper.measureText(text).width + lead + (small ? 5 : 7);
  const half_px = small ? 7 : 9;
  const across = (Math.abs(c) * (front - rear)) / 2 + Math.abs(s) * half;
  const along = (Math.abs(s) * (front - rear)) / 2 + Math.abs(c) * half;
  const [x, y] = placeOf(
    [view.x(car.x_m + middle * c), view.y(car.y_m + middle * s)],
    [across * view.scale + width / 2 + 4, along * view.scale + 12],
    [width / 2, half_px],
    heads,
  );
  paper.beginPath();
  paper.roundRect(x - width / 2, y - half_px, width, 2 * half_px, half_px);
  paper.fillStyle = chosen ? "#ffffff" : "rgba(13, 18, 24, 0.88)";
  paper.fill();
  if (!small) dot(paper, x - width / 2 + 10, y, 3.5, colour);
  paper.fillStyle = chosen ? "#10151b" : "#f1f4f8";
  paper.fillText(text, x - width / 2 + lead, y + 0.5);
}

/** The middle of a name: above the car, below it, right or left of it, as the first of these is free of heads. */
export function placeOf([x, y], [aside, above], [halfWide, halfHigh], heads) {
  const places = [[x, y - above], [x, y + above], [x + aside, y], [x - aside, y]];
  const isFree = ([px, py]) =>
    heads.every(
      ([left, top, right, bottom]) =>
        px + halfWide < left || px - halfWide > right || py + halfHigh < top || py - halfHigh > bottom,
    );
  return places.find(isFree) ?? places[0];
}
