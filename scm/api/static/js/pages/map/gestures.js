/** Fingers and mouse on the map: drag pans, wheel and pinch zoom, a click chooses, two clicks zoom in. */
import { effect } from "@preact/signals";
import { followed } from "scm/pages/map/layers.js";
import { viewChanged } from "scm/pages/map/viewport.js";

const CLICK_PX = 5;
const WHEEL = 0.0015;
const LINE_PX = 16; // of a wheel that counts in lines

/**
 * Listen to an element's pointers; `onClick(x, y)` receives clicks.
 * @param onAim receives where a pointer was pressed and where it is; returns whether it takes that press, which then moves nothing.
 * @returns the function that ends it.
 */
export function gestures(element, view, onClick, onAim) {
  const down = new Map();
  let moved = 0;
  let pressed = null; // where the press began that gives a goal; null: it moves the map
  const at = (event) => {
    const { left, top } = element.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  };
  const handlers = {
    pointerdown(event) {
      if (event.button) return;
      element.setPointerCapture(event.pointerId);
      if (!down.size) moved = 0;
      down.set(event.pointerId, at(event));
      pressed = down.size === 1 && onAim(at(event), at(event)) ? at(event) : null;
    },
    pointermove(event) {
      const before = down.get(event.pointerId);
      if (!before) return;
      const here = at(event);
      const others = [...down].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      moved += Math.hypot(here[0] - before[0], here[1] - before[1]);
      down.set(event.pointerId, here);
      if (pressed) onAim(pressed, here);
      else if (others.length) pinch(view, others[0], before, here);
      else if (moved > CLICK_PX) drag(view, before, here);
    },
    pointerup(event) {
      if (!down.delete(event.pointerId) || pressed) return;
      if (!down.size && moved <= CLICK_PX) onClick(...at(event));
    },
    pointercancel: (event) => down.delete(event.pointerId),
    dblclick: (event) => view.zoom(2, ...at(event)),
    wheel(event) {
      event.preventDefault();
      const pixels = event.deltaY * (event.deltaMode ? LINE_PX : 1);
      view.zoom(Math.exp(-WHEEL * Math.max(-400, Math.min(400, pixels))), ...middle(event));
    },
  };
  /** A followed car stays in the middle, whatever the mouse points at. */
  const middle = (event) => (followed.value ? [] : at(event));
  for (const [name, handle] of Object.entries(handlers)) element.addEventListener(name, handle, { passive: false });
  // All of the map is seen: a finger scrolls the page. Part of it: a finger moves the map.
  const touch = effect(() => {
    viewChanged.value;
    element.dataset.whole = view.isWhole;
  });
  return () => {
    touch();
    for (const [name, handle] of Object.entries(handlers)) element.removeEventListener(name, handle);
  };
}

function drag(view, before, here) {
  followed.value = null;
  view.pan(here[0] - before[0], here[1] - before[1]);
}

function pinch(view, still, before, here) {
  const [was, is] = [before, here].map((place) => Math.hypot(place[0] - still[0], place[1] - still[1]));
  if (was > 1) view.zoom(is / was, (still[0] + here[0]) / 2, (still[1] + here[1]) / 2);
}
