/**
 * The one store: what the live stream told last, and how fresh it is.
 *
 * A page names the topics that it shows with `useTopics`; the stream carries those that anybody shows,
 * and the two of the shell. `topic(name)` is a signal of a topic's newest body, null until it was heard.
 */
import { batch, computed, signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { enter } from "scm/shell/api.js";

const EVENTS_KEPT = 200;
const STALE_MS = 500;
const LOST_MS = 2000;
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

/** @returns the signal of when a topic was last told, on this page's clock [ms]. */
export function toldAt(name) {
  topic(name);
  return bodiesAt.get(name);
}

export const pulse = computed(
  () =>
    topic("pulse").value ??
    { t_ns: null, tick: null, real_time_factor: 0, late_ticks: 0, vehicles: 0, moving: 0, silent_signals: [] },
);
export const stop = computed(() => topic("stop").value ?? { engaged: false, by: "", reason: "" });
export const signals = computed(() => topic("signals").value ?? []);
export const signalsAt = computed(() => toldAt("signals").value);
export const boxes = computed(() => topic("boxes").value ?? []);
export const cameras = computed(() => topic("eye").value ?? []);
export const stations = computed(() => topic("stations").value ?? []);

const connected = signal(false);
const tickAt = signal(-Infinity);

/** `connecting`, `live`, `stale` (nothing new for 0.5 s) or `lost` (for 2 s). */
export const link = computed(() => {
  if (tickAt.value === -Infinity) return "connecting";
  const quiet = now.value - tickAt.value;
  if (quiet > LOST_MS) return "lost";
  return quiet > STALE_MS ? "stale" : "live";
});

/** Seconds since the world last moved on. */
export const quiet_s = computed(() => Math.max(0, (now.value - tickAt.value) / 1000));

/** Whether this page hears the server, whatever the world does. */
export const isConnected = computed(() => connected.value);

/** How many components show each topic. */
const shown = new Map();

/** Hear topics for as long as the component is on the page. */
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

let source = null;
let heard = "";
let gathering = null;
let entered = false;

function gather() {
  gathering ??= setTimeout(() => {
    gathering = null;
    if (entered && wanted() !== heard) listen();
  }, GATHER_MS);
}

function wanted() {
  const names = [...shown].filter(([, count]) => count > 0).map(([name]) => name);
  return [...new Set([...SHELL, ...names])].toSorted().join();
}

/** The world's clock went on: by whichever topic says so. */
function noteTick(tick, at) {
  if (tick === null || tick === live.tick) return;
  live.tick = tick;
  tickAt.value = at;
}

function takeVehicles(body, at) {
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

function takeEvents(list) {
  if (!list.length) return;
  const newest = events.value.length ? events.value[0].seq : 0;
  const fresh = list.filter((event) => event.seq > newest).reverse();
  if (fresh.length) events.value = [...fresh, ...events.value].slice(0, EVENTS_KEPT);
}

function take(topics) {
  const at = performance.now();
  batch(() => {
    for (const [name, body] of Object.entries(topics)) {
      if (name === "run") continue;
      if (name === "vehicles") takeVehicles(body, at);
      else if (name === "events") takeEvents(body);
      else {
        topic(name).value = body;
        toldAt(name).value = at;
        if (name === "pulse") noteTick(body.tick, at);
      }
    }
  });
}

let run = null;

function listen() {
  source?.close();
  heard = wanted();
  const own = new EventSource(`/api/v1/stream?topics=${heard}`);
  source = own;
  own.onopen = () => (connected.value = true);
  own.onerror = () => {
    if (source !== own) return;
    connected.value = false;
    // Refused for good, as with a key that has ended: a stream that only broke tries again itself.
    if (own.readyState === EventSource.CLOSED) again();
  };
  own.addEventListener("snapshot", (message) => {
    const topics = JSON.parse(message.data);
    // After a restart of the server its events are numbered from one again.
    if (run !== null && topics.run !== run) events.value = [];
    run = topics.run;
    take(topics);
  });
  own.addEventListener("delta", (message) => take(JSON.parse(message.data)));
}

window.addEventListener("pagehide", () => source?.close());
window.addEventListener("pageshow", (event) => event.persisted && entered && listen());

function keepTime() {
  let beats = 0;
  setInterval(() => {
    batch(() => {
      now.value = performance.now();
      if (beats++ % 2 === 0 && live.topic) world.value = live.topic;
    });
  }, 100);
}

async function again() {
  const may = await enter().catch(() => null);
  if (may) listen();
  else if (may === null) setTimeout(again, 2000);
}

/** Begin: read the map once, then listen for ever. */
export async function start() {
  keepTime();
  if (!(await enter().catch(() => true))) return;
  entered = true;
  listen();
  const response = await fetch("/api/v1/map");
  city.value = await response.json();
}
