/** Cars between two states: from where they were drawn to where they are, so that 20 Hz looks smooth. */

const LEAST_GLIDE_MS = 40;
const MOST_GLIDE_MS = 250;
const JUMP_M = 0.5;
const TURN = 2 * Math.PI;

/** Where each car is drawn: columns `x`, `y`, `yaw` over the rows of a fleet. */
export class Glide {
  constructor() {
    this.x = this.y = this.yaw = new Float32Array();
    this.from = { x: this.x, y: this.y, yaw: this.yaw };
    this.glide_ms = 60;
    this.sequence = -1;
    this.generation = -1;
    this.rows = new Map();
  }

  /** Move on to now: `fleet` has the columns `x`, `y`, `yaw`, `count`, `rows`, `sequence`, `generation`, `at`. */
  step(fleet, now = performance.now()) {
    if (fleet.sequence !== this.sequence) this.#begin(fleet, now);
    const share = Math.min(1, (now - this.began) / this.glide_ms);
    const { from, x, y, yaw } = this;
    for (let i = 0; i < fleet.count; i++) {
      const dx = fleet.x[i] - from.x[i];
      const dy = fleet.y[i] - from.y[i];
      const part = Math.abs(dx) + Math.abs(dy) > JUMP_M ? 1 : share;
      const turn = fleet.yaw[i] - from.yaw[i];
      x[i] = from.x[i] + part * dx;
      y[i] = from.y[i] + part * dy;
      yaw[i] = from.yaw[i] + part * (turn - TURN * Math.round(turn / TURN));
    }
  }

  #begin(fleet, now) {
    const passed = now - (this.began ?? now);
    this.began = now;
    if (passed > 0) {
      const glide_ms = 0.7 * this.glide_ms + 0.3 * passed; // one period behind, evenly
      this.glide_ms = Math.min(MOST_GLIDE_MS, Math.max(LEAST_GLIDE_MS, glide_ms));
    }
    if (fleet.generation === this.generation && fleet.count === this.x.length) {
      for (const name of ["x", "y", "yaw"]) this.from[name].set(this[name]);
    } else this.#rename(fleet);
    this.sequence = fleet.sequence;
  }

  /** Cars came or left: those that stayed go on from where they were drawn. */
  #rename(fleet) {
    const before = { x: this.x, y: this.y, yaw: this.yaw, rows: this.rows };
    for (const name of ["x", "y", "yaw"]) {
      const column = Float32Array.from(fleet[name]);
      for (const [vehicle, row] of fleet.rows) {
        const old = before.rows.get(vehicle);
        if (old !== undefined && old < before.x.length) column[row] = before[name][old];
      }
      this[name] = column;
      this.from[name] = Float32Array.from(column);
    }
    this.rows = fleet.rows;
    this.generation = fleet.generation;
  }
}
