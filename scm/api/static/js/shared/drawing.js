/** The server's drawings of maps: which part of the floor they show. */
import { placed } from "scm/shared/base.js";

const BOX = /\bviewBox="([^"]+)"/;

/** Read a drawing's frame: map metres, x right; its y counts down, so the map's y is -y. */
export async function readBox(address) {
  const response = await fetch(placed(address));
  const found = BOX.exec(await response.text()); // to parse all of a large city took longer than to draw it
  if (!found) throw new Error(`${address} is no drawing`);
  const [left, top, width, height] = found[1].split(/[\s,]+/).map(Number);
  return { left, top, width, height };
}
