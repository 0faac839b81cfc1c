/**
 * What stays open to the server. A browser grants six connections to it, to all its tabs together: they are
 * given up while nobody looks, and for a moment when the red button waits for one.
 */
import { enter } from "scm/shell/api.js";

const ROOM_MS = 1000;
const AGAIN_MS = 2000;

/** Of every stream, what looks again whether it may be open. */
const all = new Set();
const tabs = new BroadcastChannel("scm-room");
let roomUntil = -Infinity;
let isGone = false;

/** Have something open for as long as somebody looks: `begin` returns what ends it. Returns what ends all of it. */
export function whileSeen(begin) {
  let end = null;
  const look = () => {
    const may = !isGone && !document.hidden && performance.now() >= roomUntil;
    if (may && !end) end = begin();
    else if (!may && end) end = void end();
  };
  all.add(look);
  look();
  return () => {
    all.delete(look);
    end?.();
  };
}

/**
 * Hear server-sent events while somebody looks: `heard` names them, and what takes each one's body.
 * @param onState is told whether the server is there, and `refused` where it wants to tell nothing: it is asked again.
 * @returns what ends it.
 */
export function hear(address, heard, onState = () => {}) {
  let isShut = false;
  return whileSeen(() => {
    let source = null;
    let timer = null;
    const open = () => {
      if (isShut) return; // the person gave no key

      source = new EventSource(address);
      for (const [name, take] of Object.entries(heard)) {
        source.addEventListener(name, (message) => take(JSON.parse(message.data)));
      }
      source.onopen = () => onState("open");
      source.onerror = () => {
        // Refused, as with a key that has ended: a stream that only broke tries again itself.
        const refused = source.readyState === EventSource.CLOSED;
        onState(refused ? "refused" : "broken");
        if (refused) timer = setTimeout(again, AGAIN_MS);
      };
    };
    const again = async () => {
      const own = timer;
      isShut = !(await enter().catch(() => true));
      if (timer === own) open();
    };
    open();
    return () => {
      clearTimeout(timer);
      timer = null;
      source?.close();
    };
  });
}

/** Every tab ends its streams for a moment, this one too. */
export function makeRoom() {
  tabs.postMessage("room");
  pause(ROOM_MS);
}

/** Ask for all streams anew: a line that is dead does not say so. */
export const renew = () => pause(0);

function pause(ms) {
  roomUntil = performance.now() + ms + 1;
  lookAll();
  setTimeout(lookAll, ms + 2);
}

function lookAll() {
  for (const look of all) look();
}

tabs.onmessage = () => pause(ROOM_MS);
document.addEventListener("visibilitychange", lookAll);
window.addEventListener("pagehide", () => lookAll((isGone = true)));
window.addEventListener("pageshow", () => lookAll((isGone = false)));
