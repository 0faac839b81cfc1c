/** A layer that is costly to draw: cached as a picture, redrawn a few times a second and moved in between. */

const EVERY_MS = 150;
const MOST_SHARE = 0.2; // of the time that may go into drawing it

export class CachedLayer {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.held = null;
    this.due = -Infinity;
  }

  /** Draw the layer; `paint(paper)` redraws it, in pixels of `view`. */
  draw(paper, view, ratio, now, paint) {
    if (now >= this.due || !this.held) this.#paint(view, ratio, now, paint);
    const { cx, cy, scale, width, height } = this.held;
    const grown = view.scale / scale;
    const [x, y] = [view.x(cx) - (grown * width) / 2, view.y(cy) - (grown * height) / 2];
    paper.drawImage(this.canvas, x, y, grown * width, grown * height);
  }

  #paint({ cx, cy, scale, width, height }, ratio, now, paint) {
    const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
    Object.assign(this.canvas, { width: wide, height: high });
    const paper = this.canvas.getContext("2d");
    paper.setTransform(ratio, 0, 0, ratio, 0, 0);
    paint(paper);
    this.held = { cx, cy, scale, width, height };
    this.due = now + Math.max(EVERY_MS, (performance.now() - now) / MOST_SHARE);
  }
}
