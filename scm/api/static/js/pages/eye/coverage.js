/** Where in the frame the board was seen: outlines of all views over the counts of each cell. */
import { useEffect, useRef } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { colours } from "scm/shell/theme.js";

const ENOUGH = 12; // points a cell

export function Coverage({ camera, views, findings }) {
  const canvas = useRef(null);
  const [width, height] = findings?.size_px ?? [camera.width_px, camera.height_px];
  const cover = findings?.cover ?? [];
  const cells = cover.flat();
  const share = cells.length ? cells.filter((count) => count > 0).length / cells.length : 0;
  const percent = Math.round(100 * share);
  useEffect(() => draw(canvas.current, cover, views), [views, findings, colours.value]);
  return html`
    <figure class="coverage">
      <canvas
        ref=${canvas}
        width=${width}
        height=${height}
        role="img"
        data-percent=${percent}
        aria-label="The board was seen in ${percent} % of the frame"
      ></canvas>
      <figcaption>${`seen in ${percent} % of the frame; the corners count most`}</figcaption>
    </figure>
  `;
}

function draw(canvas, cover, views) {
  const paper = canvas.getContext("2d");
  const { width, height } = canvas;
  const css = getComputedStyle(canvas);
  paper.clearRect(0, 0, width, height);
  paper.fillStyle = css.color;
  cover.forEach((row, down) => row.forEach((count, across) => {
    paper.globalAlpha = 0.55 * Math.min(1, count / ENOUGH);
    const [wide, high] = [width / row.length, height / cover.length];
    paper.fillRect(across * wide, down * high, wide - 2, high - 2);
  }));
  paper.globalAlpha = 0.9;
  paper.strokeStyle = css.caretColor; // the style sheet's, as a plain colour
  paper.lineWidth = width / 320;
  for (const { found } of views) {
    if (!found) continue;
    paper.beginPath();
    for (const corner of found.outline_px) paper.lineTo(...corner);
    paper.closePath();
    paper.stroke();
  }
  paper.globalAlpha = 1;
}
