/** Construction boxes that cars can push, where they are now. */

const FILL = "#d9904a";
const EDGE = "#8d5a28";

/** Draw boxes; their sizes stand in the map, by name. */
export function drawBoxes(paper, view, boxes, sizes) {
  for (const box of boxes) {
    const size = sizes.find((other) => other.name === box.name);
    if (size) drawBox(paper, view, box, size);
  }
}

function drawBox(paper, view, box, { length_m, width_m }) {
  const [length, width] = [length_m * view.scale, width_m * view.scale];
  paper.save();
  paper.translate(view.x(box.x_m), view.y(box.y_m));
  paper.rotate(-box.yaw_rad);
  paper.beginPath();
  paper.rect(-length / 2, -width / 2, length, width);
  paper.fillStyle = FILL;
  paper.fill();
  paper.lineWidth = Math.max(1, 0.008 * view.scale);
  paper.strokeStyle = EDGE;
  paper.stroke();
  paper.restore();
}
