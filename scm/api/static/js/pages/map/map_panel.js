/** The map with its controls: pan, zoom and choose by mouse, touch and keyboard. */
import { computed } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { carNamed, fleet, fleetTick } from "scm/pages/map/fleet.js";
import { readGround } from "scm/pages/map/ground.js";
import { gestures } from "scm/pages/map/gestures.js";
import { followed, layers } from "scm/pages/map/layers.js";
import { pollPlans, PlanKey } from "scm/pages/map/autonomy.js";
import { aim, isAiming, ParkChip, stopAiming } from "scm/pages/map/park_at.js";
import { LayersMenu } from "scm/pages/map/layers_menu.js";
import { subscribeCloseUp } from "scm/pages/map/close_up.js";
import { pollTracks } from "scm/pages/map/tracks.js";
import { CostmapKey, pollCostmap } from "scm/pages/map/costmap.js";
import { followRoomMaps, RoomMapKey } from "scm/pages/map/room_maps.js";
import { HeatKey, Kinds, ScaleBar } from "scm/pages/map/legend.js";
import { Scene } from "scm/pages/map/scene.js";
import { offer, SendChip, withdraw } from "scm/pages/map/send_to.js";
import { Viewport, viewChanged } from "scm/pages/map/viewport.js";
import { selected } from "scm/shared/selection.js";
import { link, now } from "scm/shell/store.js";

const ROADS = "/api/v1/map.svg";
const ZOOM = 1.4;
const PAN_PX = 80;
const STALE_MS = 500;

/** How fresh the map is: as the page, but stale also when only the cars' own stream is silent. */
const linkState = computed(() => {
  const quiet = now.value - fleet.at > STALE_MS;
  return link.value === "live" && quiet ? "stale" : link.value;
});

/** Of the ground, read once: a map stays as it is while its city runs. */
let reading = null;

function groundOnce() {
  reading ??= readGround(ROADS).catch((error) => {
    reading = null; // coming back reads it again
    throw error;
  });
  return reading;
}

export function MapPanel() {
  const canvas = useRef(null);
  const sheet = useRef(null);
  const [ground, setGround] = useState(null);
  const [view, setView] = useState(null);
  useEffect(() => void groundOnce().then(setGround, setGround), []);
  useEffect(() => {
    if (!ground?.box) return undefined;
    const seen = new Viewport(ground.box);
    const scene = new Scene(canvas.current, ground, seen);
    setView(seen);
    const aimed = (from, to) => isAiming() && (aim(seen, from, to), true);
    const moves = gestures(sheet.current, seen, (x, y) => choose(scene.pick(x, y), seen, x, y), aimed);
    const ends = [scene.run(), moves, subscribeCloseUp(), pollTracks(), pollPlans(), pollCostmap(), followRoomMaps()];
    return () => ends.forEach((end) => end());
  }, [ground]);
  if (ground instanceof Error) {
    return html`<section class="panel map" role="alert"><p class="empty">The map could not be read: ${ground.message}</p></section>`;
  }
  return html`
    <section class="panel map" aria-label="Map">
      <div
        class="sheet"
        ref=${sheet}
        data-link=${linkState.value}
        data-aiming=${isAiming()}
        tabindex="0"
        role="group"
        aria-label="Map: arrows move it, plus and minus zoom, 0 shows all, F follows the chosen car"
        onKeyDown=${(event) => view && onKey(event, view)}
      >
        <canvas
          ref=${canvas}
          role="img"
          aria-label="Map of the city with its cars and signals; the tables show the same in words"
        ></canvas>
      </div>
      ${view && html`<${Controls} view=${view} />`}
      <div class="corner"><${ParkChip} /><${SendChip} /><${FollowChip} /><${HeatKey} /><${CostmapKey} /><${RoomMapKey} /><${PlanKey} /><${Kinds} />${view && html`<${ScaleBar} view=${view} />`}</div>
    </section>
  `;
}

/** A click: on a car it is chosen, on a lane the chosen car may be sent there, elsewhere it is let go. */
function choose(vehicle, view, x, y) {
  if (vehicle) withdraw();
  else if (offer(view, x, y)) return;
  selected.value = vehicle;
  if (followed.value) followed.value = vehicle;
}

function Controls({ view }) {
  viewChanged.value; // the scale that cannot be passed
  const zoom = (factor) => view.zoom(factor);
  const car = selected.value;
  const follow = () => (followed.value = followed.value ? null : car);
  return html`
    <div class="controls" role="group" aria-label="Map controls">
      <button aria-label="Zoom in" title="Zoom in (+)" onClick=${() => zoom(ZOOM)}>+</button>
      <button aria-label="Zoom out" title="Zoom out (−)" onClick=${() => zoom(1 / ZOOM)}>−</button>
      <button
        aria-label="Show all"
        title="Show all (0)"
        disabled=${view.isWhole}
        onClick=${() => showAll(view)}
      >⤢</button>
      <button
        class="follow"
        aria-label="Follow the chosen car"
        title=${car ? `Follow ${car} (F)` : "Choose a car to follow it"}
        aria-pressed=${followed.value !== null}
        disabled=${!car && !followed.value}
        onClick=${follow}
      >◎</button>
    </div>
    <${LayersMenu} />
  `;
}

function showAll(view) {
  followed.value = null;
  view.showAll();
}

/** Says what the map follows, and that a car left. */
function FollowChip() {
  if (!followed.value) return null;
  fleetTick.value; // looks again whether it is still there
  const gone = !carNamed(followed.value);
  return html`
    <button class="chip" onClick=${() => (followed.value = null)}>
      ${gone ? `${followed.value} left the map` : `Following ${followed.value}`} <span aria-hidden="true">✕</span>
      <span class="hidden">Stop following</span>
    </button>
  `;
}

const KEYS = {
  "+": (view) => view.zoom(ZOOM),
  "=": (view) => view.zoom(ZOOM),
  "-": (view) => view.zoom(1 / ZOOM),
  0: showAll,
  ArrowLeft: (view) => move(view, PAN_PX, 0),
  ArrowRight: (view) => move(view, -PAN_PX, 0),
  ArrowUp: (view) => move(view, 0, PAN_PX),
  ArrowDown: (view) => move(view, 0, -PAN_PX),
  f: () => (followed.value = followed.value ? null : selected.value),
  l: () => (layers.value = { ...layers.value, lidar: !layers.value.lidar }),
  Escape: () => {
    if (isAiming()) return stopAiming();
    withdraw();
    followed.value = selected.value = null;
  },
};

function move(view, dx, dy) {
  followed.value = null;
  view.pan(dx, dy);
}

function onKey(event, view) {
  const act = KEYS[event.key];
  if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  act(view);
}
