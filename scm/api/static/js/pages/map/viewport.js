/** Which part of the floor is on the screen: metres to pixels and back, zoom, pan, and all of it. */
import { signal } from "@preact/signals";

const MOST_PX_PER_M = 1600;
const LEAST_SHARE = 0.6; // of the scale at which all is seen
const ROOM_M = 0.3; // beyond the edge that may be brought to the middle

/** Counts changes of what is seen, for the scale bar. */
export const viewChanged = signal(0);

export class Viewport {
  /** @param box what there is: `left`, `top`, `width`, `height` [m], y counting down. */
  constructor(box) {
    this.box = box;
    this.width = this.height = 1;
    this.isWhole = true;
    this.scale = 1;
    this.cx = box.left + box.width / 2;
    this.cy = -(box.top + box.height / 2);
  }

  /** Pixels of a place on the floor. */
  x(x_m) {
    return this.width / 2 + this.scale * (x_m - this.cx);
  }

  y(y_m) {
    return this.height / 2 - this.scale * (y_m - this.cy);
  }

  /** The place on the floor under a pixel. */
  place(x, y) {
    return [this.cx + (x - this.width / 2) / this.scale, this.cy - (y - this.height / 2) / this.scale];
  }

  get wholeScale() {
    return Math.min(this.width / this.box.width, this.height / this.box.height);
  }

  resize(width, height) {
    if (width === this.width && height === this.height) return;
    [this.width, this.height] = [width, height];
    if (this.isWhole) this.showAll();
    else this.#limit();
  }

  showAll() {
    this.isWhole = true;
    this.scale = this.wholeScale;
    this.cx = this.box.left + this.box.width / 2;
    this.cy = -(this.box.top + this.box.height / 2);
    viewChanged.value += 1;
  }

  /** Make everything `factor` times as large; the place under the pixel stays where it is. */
  zoom(factor, x = this.width / 2, y = this.height / 2) {
    const [px, py] = this.place(x, y);
    this.scale *= factor;
    this.#limit();
    const [qx, qy] = this.place(x, y);
    this.centre(this.cx + px - qx, this.cy + py - qy);
  }

  pan(dx, dy) {
    this.centre(this.cx - dx / this.scale, this.cy + dy / this.scale);
  }

  centre(x_m, y_m) {
    [this.cx, this.cy] = [x_m, y_m];
    this.#limit();
  }

  #limit() {
    const { left, top, width, height } = this.box;
    const least = LEAST_SHARE * this.wholeScale;
    this.scale = Math.min(Math.max(MOST_PX_PER_M, least), Math.max(least, this.scale));
    this.cx = Math.min(left + width + ROOM_M, Math.max(left - ROOM_M, this.cx));
    this.cy = Math.min(-top + ROOM_M, Math.max(-top - height - ROOM_M, this.cy));
    this.isWhole = false;
    viewChanged.value += 1;
  }
}
