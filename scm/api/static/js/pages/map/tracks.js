/** The Eye's tracks over the map: where all cameras together take each car to be; asked for while they are shown. */
import { effect } from "@preact/signals";
import { placed } from "scm/shared/base.js";
import { layers } from "scm/pages/map/layers.js";

const ASK_MS = 500;
const LEAST_PX = 7;
const AHEAD_M = 0.25;
const GOOD = "#35d0ff";
const DOUBTED = "#ffb000";

/** The newest; bodies of the rows of `/eye/tracks`. */
export const tracks = { rows: [] };

/** Ask for tracks as long as the layer is on; returns what ends it. */
export function hearTracks() {
  return effect(() => {
    if (!layers.value.tracks) return undefined;
    let ended = false;
    const ask = async () => {
      const response = await fetch(placed("/api/v1/eye/tracks")).catch(() => null);
      const body = response?.ok ? await response.json().catch(() => null) : null;
      if (!ended) tracks.rows = body?.tracks ?? [];
    };
    ask();
    const asking = setInterval(() => !document.hidden && ask(), ASK_MS);
    return () => {
      ended = true;
      clearInterval(asking);
      tracks.rows = [];
    };
  });
}

/** Draw each track: two standard deviations around it, and ahead of it a line; dashed if stale. */
export function drawTracks(paper, view) {
  paper.save();
  paper.lineWidth = 2;
  for (const one of tracks.rows) {
    const [x, y] = [view.x(one.x_m), view.y(one.y_m)];
    const radius = Math.max(LEAST_PX, 2 * Math.max(one.std_x_m, one.std_y_m) * view.scale);
    const [c, s] = [Math.cos(one.yaw_rad), Math.sin(one.yaw_rad)];
    paper.strokeStyle = one.stale || one.flags.length ? DOUBTED : GOOD;
    paper.setLineDash(one.stale ? [4, 3] : []);
    paper.beginPath();
    paper.arc(x, y, radius, 0, 2 * Math.PI);
    paper.moveTo(x, y);
    paper.lineTo(view.x(one.x_m + AHEAD_M * c), view.y(one.y_m + AHEAD_M * s));
    paper.stroke();
  }
  paper.restore();
}
