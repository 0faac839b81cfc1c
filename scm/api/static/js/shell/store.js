/**
 * The one store: the newest of the live stream, and how fresh it is.
 *
 * A page names the topics that it shows with `useTopics`; the stream carries those that anybody shows,
 * and the two of the shell. `topic(name)` is a signal of a topic's newest body, null until it was received.
 */
import { batch, computed, signal, useComputed } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { enter } from "scm/shell/api.js";
import { subscribe, RANKS, renew } from "scm/shell/streams.js";
import { placed } from "scm/shared/base.js";

const MAX_EVENTS = 200;
const STALE_MS = 500;
const LOST_MS = 2000;
const SILENT_MS = 2500; // a running server sends something each second
const DEAD_MS = 5000; // a connection silent for so long is opened again
const AGAIN_MS = 2000;
const SHELL = ["pulse", "stop"];
const GATHER_MS = 20; // pages come and go together: one new stream, not one each

/** Newest vehicles topic at full rate: for the map. `at` is when it came, on this page's clock. */
export const live = { vehicles: [], tick: null, at: 0, sequence: 0, t_ns: null };

/** The same at 5 Hz: for tables. */
export const world = signal({ t_ns: null, tick: null, vehicles: [] });

/** Newest first. */
export const events = signal([]);

/** The map as data; null until it was read. */
export const city = signal(null);

/** What the window is called while a page shows something of its own; empty: the page and the city. */
export const windowTitle = signal("");

/** This page's clock [ms], ten times a second: what counts down reads it. */
export const now = signal(performance.now());

const bodies = new Map();
const bodiesAt = new Map();

/** @returns the signal of a topic's newest body. */
export function topic(name) {
  if (!bodies.has(name)) {
    bodies.set(name, signal(null));
    bodiesAt.set(name, signal(-Infinity));
  }
  return bodies.get(name);
}

/** @returns the signal of when a topic was last updated, on this page's clock [ms]. */
export function updatedAt(name) {
  topic(name);
  return bodiesAt.get(name);
}

export const pulse = computed(
  () =>
    topic("pulse").value ??
    { t_ns: null, tick: null, real_time_factor: 0, late_ticks: 0, vehicles: 0, moving: 0, silent_signals: [], disturbances: [] },
);
export const stop = computed(() => topic("stop").value ?? { engaged: false, by: "", reason: "" });
export const signals = computed(() => topic("signals").value ?? []);
export const signalsAt = computed(() => updatedAt("signals").value);
export const boxes = computed(() => topic("boxes").value ?? []);
export const cameras = computed(() => topic("eye").value ?? []);
export const stations = computed(() => topic("stations").value ?? []);

const connected = signal(false);
const receivedAt = signal(-Infinity);
const tickAt = signal(-Infinity);

/** When somebody began to look: hidden pages receive nothing. */
const seenAt = signal(-Infinity);

/** `connecting`, `live`, `stale` (nothing new for 0.5 s) or `lost` (for 2 s). */
export const link = computed(() => {
  if (tickAt.value === -Infinity) return "connecting";
  const quiet = now.value - tickAt.value;
  if (quiet > LOST_MS && now.value - seenAt.value > STALE_MS) return "lost";
  return quiet > STALE_MS ? "stale" : "live";
});

/** Seconds since the world last moved on. */
export const quiet_s = computed(() => Math.max(0, (now.value - tickAt.value) / 1000));

/** Whether this page receives from the server, whatever the world does. */
export const isConnected = computed(() => connected.value && now.value - receivedAt.value < SILENT_MS);

/** Whether what came at a time of this page's clock [ms] is old. */
export const isOld = (at) => now.value - at > STALE_MS;

/** The same of a signal, for a component that is drawn anew when that changes. */
export const useOld = (at) => useComputed(() => isOld(at.value)).value;

/** Age of the world's newest report once it is no longer fresh [ms]; else 0. */
export const since_ms = computed(() => (link.value === "live" ? 0 : 1000 * quiet_s.value));

/** How many components show each topic. */
const shown = new Map();

/** Subscribe to topics while the component is on the page. */
export function useTopics(...names) {
  useEffect(() => {
    for (const name of names) shown.set(name, (shown.get(name) ?? 0) + 1);
    gather();
    return () => {
      for (const name of names) shown.set(name, shown.get(name) - 1);
      gather();
    };
  }, [names.join()]);
}

let ending = null;
let subscribed = "";
let gathering = null;
let entered = false;

function gather() {
  gathering ??= setTimeout(() => {
    gathering = null;
    if (entered && wanted() !== subscribed) listen();
  }, GATHER_MS);
}

function wanted() {
  const names = [...shown].filter(([, count]) => count > 0).map(([name]) => name);
  return [...new Set([...SHELL, ...names])].toSorted().join();
}

/** The world's clock advanced, according to any topic. */
function noteTick(tick, at) {
  if (tick === null || tick === live.tick) return;
  live.tick = tick;
  tickAt.value = at;
}

function applyVehicles(body, at) {
  if (body.tick === null && live.topic) return; // a server that has just started: what was received before is newer
  if (body.tick !== null && body.t_ns !== live.t_ns) {
    live.t_ns = body.t_ns;
    live.at = at;
    live.sequence += 1;
  }
  noteTick(body.tick, at);
  live.vehicles = body.vehicles;
  noteIndicators(body.vehicles, at);
  live.topic = body;
}

/** When each indicator was last seen lit: it is dark for half of each second though it is on. */
const litAt = new Map();
const BLINK_MS = 1100;

function noteIndicators(vehicles, at) {
  for (const vehicle of vehicles) {
    for (const side of ["left", "right"]) {
      if (vehicle.lights.includes(side)) litAt.set(`${vehicle.vehicle}/${side}`, at);
    }
  }
}

/** How a vehicle's indicators are switched: `off`, `left`, `right` or `hazard`. */
export function indicatorsOf(vehicle) {
  const at = performance.now();
  const [left, right] = ["left", "right"].map(
    (side) => at - (litAt.get(`${vehicle.vehicle}/${side}`) ?? -Infinity) < BLINK_MS,
  );
  return left && right ? "hazard" : left ? "left" : right ? "right" : "off";
}

function applyEvents(list) {
  if (!list.length) return;
  const newest = events.value.length ? events.value[0].seq : 0;
  const fresh = list.filter((event) => event.seq > newest).reverse();
  if (fresh.length) events.value = [...fresh, ...events.value].slice(0, MAX_EVENTS);
}

function apply(topics) {
  const at = performance.now();
  batch(() => {
    for (const [name, body] of Object.entries(topics)) {
      if (name === "run") continue;
      if (name === "vehicles") applyVehicles(body, at);
      else if (name === "events") applyEvents(body);
      else {
        topic(name).value = body;
        updatedAt(name).value = at;
        if (name === "pulse") noteTick(body.tick, at);
      }
    }
  });
}

let run = null;

function listen() {
  ending?.();
  subscribed = wanted();
  lineAt = performance.now();
  const noted = (apply) => (topics) => {
    lineAt = receivedAt.value = performance.now();
    apply(topics);
  };
  ending = subscribe(
    `/api/v1/stream?topics=${subscribed}`,
    { snapshot: noted(applySnapshot), delta: noted(apply), beat: noted(() => {}) },
    RANKS.city,
    (isOpen) => (connected.value = isOpen),
  );
}

function applySnapshot(topics) {
  // After a restart of the server its events are numbered from one again, and its city may be another.
  if (run !== null && topics.run !== run) {
    events.value = [];
    readCity();
  }
  run = topics.run;
  apply(topics);
  if (wasDead) renew();
  wasDead = false;
}

/** When the connection was opened, or last delivered something. */
let lineAt = -Infinity;
let wasDead = false;

function keepLine() {
  if (document.hidden || !entered) lineAt = performance.now();
  if (performance.now() - lineAt < DEAD_MS) return;
  wasDead = true;
  listen();
}

function keepTime() {
  let ticks = 0;
  const look = () => batch(() => (seenAt.value = now.value = performance.now()));
  document.addEventListener("visibilitychange", look);
  setInterval(() => {
    batch(() => {
      now.value = performance.now();
      if (ticks++ % 2 === 0 && live.topic) world.value = live.topic;
    });
    keepLine();
  }, 100);
}

/** Read the map; a page of another city's begins anew. */
async function readCity() {
  for (;;) {
    const reply = await fetch(placed("/api/v1/map")).catch(() => null);
    const text = reply?.ok ? await reply.text().catch(() => "") : "";
    if (text && mapText && text !== mapText) location.reload();
    if (text && !mapText) city.value = JSON.parse((mapText = text));
    if (text) return;
    await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
  }
}

let mapText = "";

/** Begin: listen from now on, and read the map. */
export async function start() {
  keepTime();
  while (!(await enter().catch(() => true))) await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
  entered = true;
  listen();
  await readCity();
}
