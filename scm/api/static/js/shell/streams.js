/**
 * What stays open to the server. A browser grants six connections to it, to all its windows together. Five of them are
 * shared out, what matters most first, so that one is left for requests; who is hidden has none.
 */
import { signal } from "@preact/signals";
import { enter } from "scm/shell/api.js";
import { placed } from "scm/shared/base.js";

/** What a stream is for, what matters most first. */
export const RANKS = { city: 0, car: 1, view: 2 };

const MOST = 5;
const ROOM_MS = 1000;
const AGAIN_MS = 2000;
const WORD_MS = 2000; // between two words of a window to the others
const GONE_MS = 5000; // after its last word

/** Whether something of this window has to wait for what others have open. */
export const isCrowded = signal(false);

/** Whether all of it has to. */
export const isShutOut = signal(false);

/** This window's streams, in the order of their ranks: `{rank, look}`. */
let all = [];
let roomUntil = -Infinity;
let isGone = false;

/** The streams that other windows request, by each window's random number: `{number, isFirst, ranks, at}`. */
const others = new Map();
const windows = new BroadcastChannel("scm-streams");
const number = Math.random();

/**
 * Have something open for as long as somebody looks and there is room: `begin` returns what ends it.
 * @param rank one of `RANKS`.
 * @returns what ends all of it.
 */
export function whileSeen(begin, rank) {
  let end = null;
  const look = (may) => {
    if (may && !end) end = begin();
    else if (!may && end) end = void end();
  };
  const own = { rank, look };
  all = [...all, own].sort((a, b) => a.rank - b.rank);
  announce();
  return () => {
    all = all.filter((one) => one !== own);
    end?.();
    announce();
  };
}

/**
 * Subscribe to server-sent events while somebody looks: `handlers` has a function for each event's body.
 * @param onOpen receives whether the connection is open.
 * @returns what ends it.
 */
export function subscribe(address, handlers, rank, onOpen = () => {}) {
  return whileSeen(() => {
    let source = null;
    let timer = null;
    const open = () => {
      source = new EventSource(placed(address));
      for (const [name, handle] of Object.entries(handlers)) {
        source.addEventListener(name, (message) => handle(JSON.parse(message.data)));
      }
      source.onopen = () => onOpen(true);
      source.onerror = () => {
        onOpen(false);
        // Refused, as with a key that has ended: a stream that only broke tries again itself.
        if (source.readyState === EventSource.CLOSED) timer = setTimeout(again, AGAIN_MS);
      };
    };
    const again = async () => {
      const own = timer;
      const may = await enter().catch(() => true);
      if (timer !== own) return;
      if (may) open();
      else timer = setTimeout(again, AGAIN_MS); // the person gave no key, and may yet
    };
    open();
    return () => {
      clearTimeout(timer);
      timer = null;
      source?.close();
    };
  }, rank);
}

/** Every window ends its streams for a moment, this one too. */
export function makeRoom() {
  windows.postMessage("room");
  pause(ROOM_MS);
}

/** Open all but the city's stream again: a dead connection reports nothing. */
export function renew() {
  for (const { rank, look } of all) if (rank > RANKS.city) look(false);
  lookAll();
}

function pause(ms) {
  roomUntil = performance.now() + ms;
  lookAll();
  setTimeout(lookAll, ms + 1);
}

const isAway = () => isGone || document.hidden;

/** Announce which streams this window requests, and apply what that changes here. */
function announce() {
  const ranks = isAway() ? [] : all.map(({ rank }) => rank);
  windows.postMessage({ number, isFirst: document.hasFocus(), ranks });
  lookAll();
}

function lookAll() {
  const now = performance.now();
  for (const [one, { at }] of others) if (now - at > GONE_MS) others.delete(one);
  const granted = isAway() || now < roomUntil ? 0 : share();
  all.forEach(({ look }, i) => look(i < granted));
  isCrowded.value = !isAway() && now >= roomUntil && granted < all.length;
  isShutOut.value = isCrowded.value && granted === 0;
}

/** How many of its streams this window may have open; all windows come to the same. */
function share() {
  const own = { number, isFirst: document.hasFocus(), ranks: all.map(({ rank }) => rank) };
  const requested = [own, ...others.values()].flatMap((one) => one.ranks.map((rank) => ({ rank, one })));
  requested.sort((a, b) => a.rank - b.rank || b.one.isFirst - a.one.isFirst || a.one.number - b.one.number);
  return requested.slice(0, MOST).filter(({ one }) => one === own).length;
}

windows.onmessage = ({ data }) => {
  if (data === "room") pause(ROOM_MS);
  else {
    const isNew = !others.has(data.number);
    others.set(data.number, { ...data, at: performance.now() });
    if (isNew && all.length) announce();
    else lookAll();
  }
};
setInterval(() => !isAway() && announce(), WORD_MS);
document.addEventListener("visibilitychange", announce);
for (const name of ["focus", "blur"]) window.addEventListener(name, announce);
window.addEventListener("pagehide", () => announce((isGone = true)));
window.addEventListener("pageshow", () => announce((isGone = false)));
