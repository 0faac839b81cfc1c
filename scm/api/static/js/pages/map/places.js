/** Places whose floor changed, as the twin part found by the cars that drive there. */
import { topic } from "scm/shell/store.js";
import { layers } from "scm/pages/map/layers.js";

const EDGE = "#ffb000";
const FILL = "rgba(255, 176, 0, 0.16)";
const RIM = "rgba(8, 12, 18, 0.75)";
const LEAST_PX = 60; // of a place, for its words to fit
const DASH_PX = [6, 4];

/** Draw each place; cars that noticed the same one lie on each other. */
export function drawPlaces(paper, view) {
  if (!layers.peek().places) return;
  for (const row of topic("twins").peek() ?? []) if (row.radius_m !== null) drawPlace(paper, view, row);
}

function drawPlace(paper, view, { x_m, y_m, radius_m }) {
  const [x, y, radius] = [view.x(x_m), view.y(y_m), radius_m * view.scale];
  paper.save();
  paper.beginPath();
  paper.arc(x, y, radius, 0, 2 * Math.PI);
  paper.fillStyle = FILL;
  paper.fill();
  paper.setLineDash(DASH_PX);
  paper.lineWidth = 2;
  paper.strokeStyle = EDGE;
  paper.stroke();
  if (2 * radius >= LEAST_PX) {
    paper.setLineDash([]);
    paper.font = "600 12px system-ui, sans-serif";
    [paper.textAlign, paper.textBaseline] = ["center", "middle"];
    [paper.lineWidth, paper.strokeStyle, paper.fillStyle] = [3, RIM, EDGE];
    paper.strokeText("floor changed", x, y);
    paper.fillText("floor changed", x, y);
  }
  paper.restore();
}
