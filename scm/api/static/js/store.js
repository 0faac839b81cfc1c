/** The one store: what the live stream told last, and how fresh it is. */
import { batch, computed, signal } from "@preact/signals";
import { enter } from "./api.js";

const EVENTS_KEPT = 200;
const STALE_MS = 500;
const LOST_MS = 2000;

/** Newest cars topic at full rate: for the map. `at` is when it came, on this page's clock. */
export const live = { cars: [], tick: null, at: 0, sequence: 0 };

/** The same at 5 Hz: for tables. */
export const world = signal({ t_ns: null, tick: null, real_time_factor: 0, late_ticks: 0, cars: [] });
export const signals = signal([]);
export const signalsAt = signal(0);
export const boxes = signal([]);
export const stop = signal({ engaged: false, by: "", reason: "" });
export const cameras = signal([]);
export const stations = signal([]);
export const events = signal([]);
export const city = signal(null);

/** This page's clock [ms], ten times a second: what counts down reads it. */
export const now = signal(performance.now());
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

function takeCars(topic) {
  const at = performance.now();
  if (topic.tick !== live.tick) {
    live.tick = topic.tick;
    live.at = at;
    live.sequence += 1;
  }
  live.cars = topic.cars;
  noteIndicators(topic.cars, at);
  live.topic = topic;
}

/** When each indicator was last seen lit: it is dark for half of each second though it is on. */
const litAt = new Map();
const BLINK_MS = 1100;

function noteIndicators(cars, at) {
  for (const car of cars) {
    for (const side of ["left", "right"]) {
      if (car.lights.includes(side)) litAt.set(`${car.vehicle}/${side}`, at);
    }
  }
}

/** How a car's indicators are switched: `off`, `left`, `right` or `hazard`. */
export function indicatorsOf(car) {
  const at = performance.now();
  const [left, right] = ["left", "right"].map(
    (side) => at - (litAt.get(`${car.vehicle}/${side}`) ?? -Infinity) < BLINK_MS,
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
  batch(() => {
    if (topics.cars) takeCars(topics.cars);
    if (topics.signals) {
      signals.value = topics.signals;
      signalsAt.value = performance.now();
    }
    if (topics.boxes) boxes.value = topics.boxes;
    if (topics.stop) stop.value = topics.stop;
    if (topics.eye) cameras.value = topics.eye;
    if (topics.stations) stations.value = topics.stations;
    if (topics.events) takeEvents(topics.events);
  });
}

let run = null;

function listen() {
  const source = new EventSource("/api/v1/stream");
  source.onopen = () => (connected.value = true);
  source.onerror = () => {
    connected.value = false;
    // Refused for good, as with a key that has ended: a stream that only broke tries again itself.
    if (source.readyState === EventSource.CLOSED) again();
  };
  source.addEventListener("snapshot", (message) => {
    const topics = JSON.parse(message.data);
    // After a restart of the server its events are numbered from one again.
    if (run !== null && topics.run !== run) events.value = [];
    run = topics.run;
    take(topics);
  });
  source.addEventListener("delta", (message) => take(JSON.parse(message.data)));
  window.addEventListener("pagehide", () => source.close());
}

function keepTime() {
  let beats = 0;
  setInterval(() => {
    batch(() => {
      now.value = performance.now();
      if (live.sequence) tickAt.value = live.at;
      if (beats++ % 2 === 0 && live.topic) world.value = live.topic;
    });
  }, 100);
}

async function again() {
  const may = await enter().catch(() => null);
  if (may) listen();
  else if (may === null) setTimeout(again, 2000);
}

/** Begin: fetch the map once, then listen for ever. */
export async function start() {
  keepTime();
  if (!(await enter().catch(() => true))) return;
  listen();
  const response = await fetch("/api/v1/map");
  city.value = await response.json();
  document.title = `${city.value.title} · Smart City Manager`;
}
