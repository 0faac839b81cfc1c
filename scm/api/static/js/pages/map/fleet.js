/**
 * All cars as columns of numbers, read from the binary stream `/vehicles.bin`.
 *
 * The layout of its frames is documented in `scm/api/vehicle_frames.py`. What moves is in `fleet`, read
 * by whoever draws; `fleetBeat` counts up four times a second, for tables and cards; ages go on in silence.
 */
import { signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { byName } from "scm/shared/format.js";
import { enter } from "scm/shell/api.js";
import { RANKS, whileSeen } from "scm/shell/streams.js";
import { placed } from "scm/shared/base.js";

const ADDRESS = placed("/api/v1/vehicles.bin");
const VERSION = 1;
const NAMES = 1;
const HEAD_BYTES = 8;
const STATES_HEAD_BYTES = 24;
const COLUMNS = ["x", "y", "yaw", "speed", "steering", "age", "done", "length"];
const TICK_MS = 250;
const AGAIN_MS = 1000;
const FIRST_LIGHT = 11;

/** Columns of `count` cars; row i is `vehicles[i]`. `at` is when they came, `sequence` how many did. */
export const fleet = {
  ...Object.fromEntries(COLUMNS.map((name) => [name, new Float32Array()])),
  flags: new Uint32Array(),
  vehicles: [],
  order: [],
  rows: new Map(),
  modes: [],
  waits: [],
  lights: [],
  count: 0,
  generation: -1,
  sequence: 0,
  at: -Infinity,
  t_s: null,
  snapshot_age_ms: 0,
};

/** Counts up four times a second while somebody looks. */
export const fleetTick = signal(0);

/** Hear the stream for as long as the component is on the page and somebody looks at it. */
export function useFleet() {
  useEffect(() => whileSeen(begin, RANKS.car), []);
}

/** One car as an object; null: there is none of that name. */
export function carNamed(name) {
  const row = fleet.rows.get(name);
  return row === undefined ? null : carAt(row);
}

export function carAt(row) {
  const flags = fleet.flags[row];
  return {
    ...fleet.vehicles[row],
    x_m: fleet.x[row],
    y_m: fleet.y[row],
    yaw_rad: fleet.yaw[row],
    speed_mps: fleet.speed[row],
    steering_rad: fleet.steering[row],
    age_ms: ageOf(row),
    done_m: fleet.done[row],
    length_m: fleet.length[row],
    alive: isAlive(row),
    mode: fleet.modes[(flags >> 1) & 31],
    waits: fleet.waits[(flags >> 6) & 31],
    lights: fleet.lights.filter((_, number) => (flags >>> (FIRST_LIGHT + number)) & 1),
  };
}

export const isAlive = (row) => (fleet.flags[row] & 1) === 1;
export const modeOf = (row) => (isAlive(row) ? fleet.modes[(fleet.flags[row] >> 1) & 31] : "lost");

/** How old a car's state is now [ms]. */
export function ageOf(row) {
  return fleet.age[row] + fleet.snapshot_age_ms + Math.max(0, performance.now() - fleet.at);
}

function begin() {
  const aborting = new AbortController();
  const ticking = setInterval(() => (fleetTick.value += 1), TICK_MS);
  listen(aborting.signal);
  return () => {
    aborting.abort();
    clearInterval(ticking);
  };
}

async function listen(ended) {
  while (!ended.aborted) {
    try {
      const response = await fetch(ADDRESS, { signal: ended });
      if (response.status === 401) await enter();
      if (response.ok) await readAll(response.body.getReader());
    } catch (error) {
      if (ended.aborted) return;
    }
    await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
  }
}

/** Read frames until the stream ends. Of several that came together only the newest states count. */
async function readAll(reader) {
  let rest = new Uint8Array();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    rest = joined(rest, value);
    rest = rest.slice(consume(new DataView(rest.buffer, rest.byteOffset, rest.byteLength)));
  }
}

function joined(first, second) {
  if (!first.length) return second;
  const both = new Uint8Array(first.length + second.length);
  both.set(first);
  both.set(second, first.length);
  return both;
}

/** @returns how many bytes were whole frames. */
function consume(view) {
  let at = 0;
  let states = null;
  while (view.byteLength - at >= HEAD_BYTES) {
    const end = at + 4 + view.getUint32(at, true);
    if (end > view.byteLength) break;
    if (view.getUint8(at + 4) !== VERSION) throw new Error("the city speaks another layout");
    const body = [view.byteOffset + at + HEAD_BYTES, view.byteOffset + end];
    if (view.getUint8(at + 5) === NAMES) applyNames(view.buffer.slice(...body));
    else states = body;
    at = end;
  }
  if (states) applyStates(view.buffer.slice(...states));
  return at;
}

function applyNames(body) {
  const names = JSON.parse(new TextDecoder().decode(body));
  const { vehicles } = names;
  Object.assign(fleet, names, {
    count: 0,
    rows: new Map(vehicles.map((car, row) => [car.vehicle, row])),
    order: [...vehicles.keys()].sort((a, b) => byName(vehicles[a].vehicle, vehicles[b].vehicle)),
  });
}

function applyStates(body) {
  const head = new DataView(body);
  if (head.getUint32(0, true) !== fleet.generation) return;
  const count = head.getUint32(4, true);
  const t_s = head.getFloat64(8, true);
  COLUMNS.forEach((name, number) => {
    fleet[name] = new Float32Array(body, STATES_HEAD_BYTES + 4 * count * number, count);
  });
  fleet.flags = new Uint32Array(body, STATES_HEAD_BYTES + 4 * count * COLUMNS.length, count);
  fleet.count = count;
  fleet.snapshot_age_ms = head.getFloat32(16, true);
  if (t_s === fleet.t_s) return; // only a sign of life: the world stands still
  fleet.t_s = t_s;
  fleet.at = performance.now() - fleet.snapshot_age_ms;
  fleet.sequence += 1;
}
