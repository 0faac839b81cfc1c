/** Grids that cars send: their cells unpacked, and painted as a picture of a pixel a cell. */

/** The cells of a grid, a byte each. */
export async function unpacked(packed) {
  const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** A picture of a grid; row 0 is its first line. `colourOf` gives red, green, blue and opacity of a byte, 0 to 255. */
export function painted(cells, { rows, columns }, colourOf) {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [Math.max(1, columns), Math.max(1, rows)];
  const paper = canvas.getContext("2d");
  const picture = paper.createImageData(canvas.width, canvas.height);
  const pixels = new Uint32Array(picture.data.buffer);
  const colours = new Uint32Array(256);
  const four = new Uint8Array(colours.buffer);
  for (let value = 0; value < 256; value++) four.set(colourOf(value), 4 * value);
  for (let i = 0; i < cells.length; i++) pixels[i] = colours[cells[i]];
  paper.putImageData(picture, 0, 0);
  return canvas;
}

/** Draw such a picture with its lower left corner at `x_m`, `y_m` of a frame whose origin lies at `origin`. */
export function drawGrid(paper, view, picture, { x_m, y_m, rows, columns, cell_m }, origin = { x: 0, y: 0, yaw: 0 }) {
  paper.save();
  paper.translate(view.x(origin.x), view.y(origin.y));
  paper.rotate(-origin.yaw);
  paper.scale(view.scale, -view.scale); // the lowest row first, as in the picture
  paper.drawImage(picture, x_m, y_m, columns * cell_m, rows * cell_m);
  paper.restore();
}
