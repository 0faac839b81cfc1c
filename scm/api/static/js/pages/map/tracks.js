/** The Eye's tracks over the map: where all cameras together take each car to be; polled while they are shown. */
import { effect } from "@preact/signals";
import { placed } from "scm/shared/base.js";
import { layers } from "scm/pages/map/layers.js";

const POLL_MS = 500;
const LEAST_PX = 7;
const AHEAD_M = 0.25;
const GOOD = "#35d0ff";
const SUSPECT = "#ffb000";

/** The newest; bodies of the rows of `/eye/tracks`. */
export const tracks = { rows: [] };

/** Poll tracks while the layer is on; returns the function that ends it. */
export function pollTracks() {
  return effect(() => {
    if (!layers.value.tracks) return undefined;
    let ended = false;
    const poll = async () => {
      const response = await fetch(placed("/api/v1/eye/tracks")).catch(() => null);
      const body = response?.ok ? await response.json().catch(() => null) : null;
      if (!ended) tracks.rows = body?.tracks ?? [];
    };
    poll();
    const timer = setInterval(() => !document.hidden && poll(), POLL_MS);
    return () => {
      ended = true;
      clearInterval(timer);
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
    paper.strokeStyle = one.stale || one.flags.length ? SUSPECT : GOOD;
    paper.setLineDash(one.stale ? [4, 3] : []);
    paper.beginPath();
    paper.arc(x, y, radius, 0, 2 * Math.PI);
    paper.moveTo(x, y);
    paper.lineTo(view.x(one.x_m + AHEAD_M * c), view.y(one.y_m + AHEAD_M * s));
    paper.stroke();
  }
  paper.restore();
}
