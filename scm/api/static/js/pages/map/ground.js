/** The roads: the server's drawing, cached as a picture of what is on the screen and a margin around it. */
import { readBox } from "scm/shared/drawing.js";
import { placed } from "scm/shared/base.js";

const RIM = 0.3; // of the screen, on every side
const REST_MS = 140; // after the last zoom, before all is drawn sharply again
const DARK = "brightness(0.72) saturate(0.85)";

/** Read the drawing, and the box that it shows: map metres, x right; its y counts down. */
export async function readGround(address) {
  const image = new Image();
  image.src = placed(address);
  const [box] = await Promise.all([readBox(address), image.decode()]);
  return { image, box };
}

export class Ground {
  constructor({ image, box }) {
    this.image = image;
    this.box = box;
    this.canvas = document.createElement("canvas");
    this.held = null; // where the picture lies: left, top [m], and its scale [px/m]
    this.moved = 0;
  }

  /** Draw the roads as seen through `view`; `ratio` is device pixels a pixel. */
  draw(paper, view, ratio, dark, now) {
    const { held } = this;
    const fits = held && held.scale === view.scale && held.ratio === ratio && held.dark === dark;
    if (!fits) {
      if (view.scale !== this.scale) [this.scale, this.moved] = [view.scale, now];
      if (!held || held.dark !== dark || now - this.moved > REST_MS) this.#paint(view, ratio, dark);
    } else if (!this.#covers(view)) this.#paint(view, ratio, dark);
    const { left, top, scale, width, height } = this.held;
    const grown = view.scale / scale;
    const [x, y] = [view.x(left), view.y(top)];
    if (grown !== 1) paper.drawImage(this.canvas, x, y, width * grown, height * grown);
    else paper.drawImage(this.canvas, whole(x, ratio), whole(y, ratio), this.canvas.width / ratio, this.canvas.height / ratio);
  }

  #covers(view) {
    const { left, top, scale, width, height } = this.held;
    const [x0, y0] = view.place(0, 0);
    const [x1, y1] = view.place(view.width, view.height);
    const seen = this.box;
    const low = Math.max(x0, seen.left);
    const high = Math.min(x1, seen.left + seen.width);
    const up = Math.min(y0, -seen.top);
    const down = Math.max(y1, -seen.top - seen.height);
    return low >= left && high <= left + width / scale && up <= top && down >= top - height / scale;
  }

  #paint(view, ratio, dark) {
    const [width, height] = [view.width * (1 + 2 * RIM), view.height * (1 + 2 * RIM)];
    const [left, top] = view.place(-RIM * view.width, -RIM * view.height);
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    const paper = this.canvas.getContext("2d");
    const scale = view.scale * ratio;
    if (dark) paper.filter = DARK;
    const { box } = this;
    paper.drawImage(
      this.image,
      (box.left - left) * scale,
      (top + box.top) * scale,
      box.width * scale,
      box.height * scale,
    );
    this.held = { left, top, scale: view.scale, ratio, dark, width, height };
  }
}

/** The nearest whole device pixel: a copy to there needs no pixel between two to be made up. */
const whole = (px, ratio) => Math.round(px * ratio) / ratio;
