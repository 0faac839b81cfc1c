/** A tag in the picture: its outline, its axes, and a label with its id and whose it is. */

import { paintOf } from "scm/shared/car_shape.js";
import { live } from "scm/shell/store.js";

const COLOURS = { car: "#38e8b0", map: "#ffd166", other: "#ff8fa3" };
const FORWARD = "#ff5d5d";
const LEFT = "#5da8ff";

/**
 * Draw one tag.
 * @param at turns a place in the picture into one on the canvas
 * @param layers which of `outline`, `id`, `axes`, `name` are wanted
 * @param ratio pixels of the canvas for one of the screen
 */
export function drawTag(paper, tag, known, at, layers, ratio, chosen) {
  const corners = tag.corners_px.map(at);
  const colour = colourOf(known);
  if (layers.outline || chosen) {
    path(paper, corners);
    stroke(paper, "rgba(0, 12, 10, 0.7)", (chosen ? 7 : 4) * ratio);
    stroke(paper, chosen ? "#ffffff" : colour, (chosen ? 3.5 : 2) * ratio);
  }
  if (layers.axes) drawAxes(paper, corners, at(tag.centre_px), ratio);
  const text = [layers.id && `${tag.tag_id}`, layers.name && nameOf(known)].filter(Boolean).join(" · ");
  if (text) drawLabel(paper, corners, text, colour, ratio);
}

/** A car has the colour that it has on the map; one that is not on the map, that of any car. */
function colourOf(known) {
  const what = known?.what ?? "other";
  const car = what === "car" ? live.vehicles.find(({ vehicle }) => vehicle === known.vehicle) : null;
  return car ? paintOf(car.kind, car.alive)[0] : COLOURS[what];
}

function nameOf(known) {
  if (known?.what === "map") return "map";
  return known?.vehicle || "nobody's";
}

/** Corners are lower left, lower right, upper right, upper left of the print; a car's front is its right. */
function drawAxes(paper, [lowerLeft, lowerRight, upperRight, upperLeft], centre, ratio) {
  const middle = (a, b) => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
  for (const [end, colour] of [[middle(upperRight, lowerRight), FORWARD], [middle(upperLeft, upperRight), LEFT]]) {
    const far = [2 * end[0] - centre[0], 2 * end[1] - centre[1]];
    paper.beginPath();
    paper.moveTo(...centre);
    paper.lineTo(...far);
    stroke(paper, "rgba(0, 12, 10, 0.7)", 5 * ratio);
    stroke(paper, colour, 2.5 * ratio);
  }
}

function path(paper, corners) {
  paper.beginPath();
  for (const corner of corners) paper.lineTo(...corner);
  paper.closePath();
  paper.lineJoin = "round";
}

function stroke(paper, style, width) {
  paper.lineCap = "round";
  paper.lineWidth = width;
  paper.strokeStyle = style;
  paper.stroke();
}

function drawLabel(paper, corners, text, colour, ratio) {
  paper.font = `600 ${12 * ratio}px system-ui, sans-serif`;
  paper.textAlign = "center";
  paper.textBaseline = "middle";
  const width = paper.measureText(text).width + 12 * ratio;
  const height = 18 * ratio;
  const x = (Math.min(...corners.map(([one]) => one)) + Math.max(...corners.map(([one]) => one))) / 2;
  const above = Math.min(...corners.map(([, y]) => y)) - height / 2 - 6 * ratio;
  const below = Math.max(...corners.map(([, y]) => y)) + height / 2 + 6 * ratio;
  const y = above < height / 2 ? below : above;
  paper.fillStyle = "rgba(6, 16, 18, 0.88)";
  paper.beginPath();
  paper.roundRect(x - width / 2, y - height / 2, width, height, 5 * ratio);
  paper.fill();
  paper.fillStyle = colour;
  paper.fillText(text, x, y + 0.5 * ratio);
}
