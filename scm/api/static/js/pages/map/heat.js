/** How fast cars are, place by place: the mean of what passed over each cell of the floor, old ones fading. */
import { signal } from "@preact/signals";

const LEAST_CELL_M = 0.08;
const CELLS_ACROSS = 200;
const FADE_S = 60;
const PAINT_MS = 400;
const LEAST_WEIGHT = 0.02;

/** Viridis: even in brightness, and read the same by those who see colours otherwise. */
const SCALE = [
  [68, 1, 84],
  [65, 68, 135],
  [42, 120, 142],
  [34, 168, 132],
  [122, 209, 81],
  [253, 231, 37],
];

/** Speed at the bright end of the scale [m/s]. */
export const fastest = signal(0.5);

export class Heat {
  /** @param box the map's: `left`, `top`, `width`, `height` [m], y counting down. */
  constructor(box) {
    this.box = box;
    this.cell = Math.max(LEAST_CELL_M, Math.max(box.width, box.height) / CELLS_ACROSS);
    this.columns = Math.ceil(box.width / this.cell);
    this.rows = Math.ceil(box.height / this.cell);
    this.sum = new Float32Array(this.columns * this.rows);
    this.weight = new Float32Array(this.columns * this.rows);
    this.canvas = document.createElement("canvas");
    this.canvas.width = this.columns;
    this.canvas.height = this.rows;
    this.t_s = null;
    this.painted = -Infinity;
  }

  /** Take in a new state of all cars. */
  note(fleet) {
    if (fleet.t_s === null || fleet.t_s === this.t_s) return;
    const passed_s = this.t_s === null ? 0 : Math.abs(fleet.t_s - this.t_s);
    this.t_s = fleet.t_s;
    const retained = Math.exp(-passed_s / FADE_S);
    for (let i = 0; i < this.sum.length; i++) {
      this.sum[i] *= retained;
      this.weight[i] *= retained;
    }
    for (let row = 0; row < fleet.count; row++) {
      if (!(fleet.flags[row] & 1)) continue;
      const column = Math.floor((fleet.x[row] - this.box.left) / this.cell);
      const line = Math.floor((-fleet.y[row] - this.box.top) / this.cell);
      if (column < 0 || line < 0 || column >= this.columns || line >= this.rows) continue;
      const at = line * this.columns + column;
      this.sum[at] += Math.abs(fleet.speed[row]);
      this.weight[at] += 1;
    }
  }

  draw(paper, view, now) {
    if (now - this.painted > PAINT_MS) this.#paint(now);
    const width = this.columns * this.cell * view.scale;
    const height = this.rows * this.cell * view.scale;
    paper.globalAlpha = 0.82;
    paper.imageSmoothingEnabled = false;
    paper.drawImage(this.canvas, view.x(this.box.left), view.y(-this.box.top), width, height);
    paper.imageSmoothingEnabled = true;
    paper.globalAlpha = 1;
  }

  #paint(now) {
    this.painted = now;
    const means = new Float32Array(this.sum.length);
    let most = 0;
    for (let i = 0; i < means.length; i++) {
      if (this.weight[i] > LEAST_WEIGHT) most = Math.max(most, (means[i] = this.sum[i] / this.weight[i]));
    }
    const end = Math.max(0.2, Math.ceil(most * 5) / 5);
    if (end !== fastest.value) fastest.value = end;
    const paper = this.canvas.getContext("2d");
    const picture = paper.createImageData(this.columns, this.rows);
    for (let i = 0; i < means.length; i++) {
      if (this.weight[i] <= LEAST_WEIGHT) continue;
      picture.data.set(colourOf(means[i] / end), 4 * i);
      picture.data[4 * i + 3] = 255 * Math.min(1, 0.35 + this.weight[i] / 8);
    }
    paper.putImageData(picture, 0, 0);
  }
}

function colourOf(share) {
  const at = Math.min(0.9999, Math.max(0, share)) * (SCALE.length - 1);
  const [low, high, part] = [SCALE[Math.floor(at)], SCALE[Math.floor(at) + 1], at % 1];
  return low.map((value, i) => Math.round(value + part * (high[i] - value)));
}
