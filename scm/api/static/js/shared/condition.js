/** How a car is, in words. */

/** Its mode in one word, unless it is lost or stuck. */
export function modeOf(car) {
  if (!car.alive) return "lost";
  return car.stuck ? "stuck" : car.mode;
}

/** What keeps a stuck car where it is, as far as is known; empty: it is not stuck. */
export function stuckBy({ stuck }) {
  if (!stuck) return "";
  if (!stuck.length) return "commanded to drive but does not move, touches nothing";
  return `pushes against ${stuck.map((name) => (name === "wall" ? "a wall" : name)).join(", ")}`;
}
