/** What plays a recording: where it is, how fast, and the frames about that moment. */
import { signal } from "@preact/signals";
import { read } from "scm/shared/fetched.js";
import { spoken } from "scm/pages/recordings/words.js";

const STRETCH_S = 10; // of one answer of the server
const HZ = 10; // drawn smoothly between
const SLOWEST_HZ = 2; // half of it is still no gap
const MAX_STRETCHES = 40; // stretches: a few minutes either way
const TEXT_PERIOD_MS = 100; // how often the page's text follows
const GAP_S = 1.5; // a silence longer than this is shown as one
const GROWS_MS = 2000;
const SKIP_SHOWN_S = 5; // of what is played after it

export const SPEEDS = [0.25, 0.5, 1, 2, 4, 8];

export class Player {
  /** @param {object} summary of the recording */
  constructor(name, summary, at_s) {
    this.name = name;
    this.length = signal(summary.recording.length_s);
    this.first_s = summary.first_frame_s;
    this.playing = signal(false);
    this.speed = signal(1);
    this.loop = signal(false);
    this.trouble = signal("");
    /** The pause that was skipped last: `{words, from_s, to_s}`, the span in which it is named. */
    this.skipped = signal(null);
    /** Where it is [s], ten times a second; `t_s` is the same for every picture. */
    this.at = signal(0);
    this.t_s = 0;
    /** Counts stretches received, so that the page is drawn again. */
    this.came = signal(0);
    this.stretches = new Map();
    this.last_ms = null;
    this.text_ms = -Infinity;
    this.seek(at_s ?? this.first_s);
    this.animation = requestAnimationFrame((ms) => this.tick(ms));
    this.growing = summary.recording.state === "being written" ? setInterval(() => this.grow(), GROWS_MS) : null;
  }

  end() {
    cancelAnimationFrame(this.animation);
    clearInterval(this.growing);
    this.over = true;
  }

  async grow() {
    const row = await read(`/recordings/${encodeURIComponent(this.name)}`).catch(() => null);
    if (row) this.length.value = row.body.length_s;
    if (row && row.body.state !== "being written") clearInterval(this.growing);
  }

  tick(ms) {
    this.animation = requestAnimationFrame((next) => this.tick(next));
    const passed_s = this.last_ms === null ? 0 : Math.min(0.25, (ms - this.last_ms) / 1000);
    this.last_ms = ms;
    if (this.playing.value && this.has(this.t_s)) this.go(this.t_s + passed_s * this.speed.value);
    if (this.playing.value) this.skipPause();
    const skipped = this.skipped.value;
    if (skipped && (this.t_s < skipped.from_s || this.t_s > skipped.to_s)) this.skipped.value = null;
    if (ms - this.text_ms > TEXT_PERIOD_MS && this.at.value !== this.t_s) {
      this.text_ms = ms;
      this.at.value = this.t_s;
    }
    this.fetch();
  }

  go(t_s) {
    if (t_s < this.length.value) {
      this.t_s = t_s;
    } else if (this.loop.value) {
      this.t_s = this.first_s;
    } else {
      this.t_s = this.length.value;
      this.playing.value = false;
    }
  }

  /** A stretch in which the world was silent is not played: what was recorded next is. */
  skipPause() {
    const next_s = this.stretchAt(this.t_s)?.next_s ?? null;
    if (next_s === null || next_s <= this.t_s) return;
    const words = `Skipped ${spoken(next_s - this.t_s)} in which the world was silent.`;
    this.seek(next_s);
    this.skipped.value = { words, from_s: next_s, to_s: next_s + SKIP_SHOWN_S };
  }

  seek(t_s) {
    this.t_s = Math.max(0, Math.min(this.length.value, t_s));
    this.at.value = this.t_s;
    this.fetch();
  }

  play(wanted = !this.playing.value) {
    if (wanted && this.t_s >= this.length.value - 0.05) this.seek(this.first_s);
    this.playing.value = wanted;
  }

  /** One frame on or back. */
  step(direction) {
    this.playing.value = false;
    this.seek(this.t_s + direction / HZ);
  }

  faster(direction) {
    const at = SPEEDS.indexOf(this.speed.value) + direction;
    this.speed.value = SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, at))];
  }

  has(t_s) {
    return Boolean(this.stretchAt(t_s)?.frames);
  }

  stretchAt(t_s) {
    return this.stretches.get(Math.floor(t_s / STRETCH_S));
  }

  /** Request what is shown now and soon. */
  fetch() {
    const first = Math.floor(this.t_s / STRETCH_S);
    const ahead = this.playing.value ? Math.ceil((this.speed.value * 4) / STRETCH_S) : 0;
    for (let number = first; number <= first + ahead; number++) {
      const start_s = number * STRETCH_S;
      if (start_s > this.length.value) break;
      const known = this.stretches.get(number);
      // Of a recording that is being written more may be there by now.
      const grew = known?.frames && known.to_s < Math.min(start_s + STRETCH_S, this.length.value) - 0.5;
      if (!known || grew) this.request(number, known);
    }
  }

  async request(number, known) {
    if (known?.isLoading) return;
    const stretch = known ?? { frames: null };
    stretch.isLoading = true;
    this.stretches.set(number, stretch);
    const start_s = number * STRETCH_S;
    const end_s = start_s + STRETCH_S;
    const length_s = this.length.value;
    try {
      const body = await this.whole(start_s, end_s);
      // As far as the file went at the request: it may still grow.
      Object.assign(stretch, body, { to_s: Math.min(end_s, Math.max(start_s, length_s)) });
      this.trouble.value = body.damaged.length ? `Left out here: ${body.damaged.join("; ")}` : "";
      stretch.isLoading = false;
      this.came.value += 1;
    } catch (error) {
      this.trouble.value = error.message;
      setTimeout(() => {
        stretch.isLoading = false;
        if (!stretch.frames) this.stretches.delete(number);
      }, 3000);
    }
    this.forget(number);
  }

  /** Frames of all of a stretch: of so many cars that one answer is too small, fewer a second. */
  async whole(start_s, end_s, hz = HZ) {
    const path = `/recordings/${encodeURIComponent(this.name)}/frames?from_s=${start_s}&to_s=${end_s}&hz=${hz}`;
    const { body } = await read(path);
    return body.to_s < end_s && hz > SLOWEST_HZ ? this.whole(start_s, end_s, hz / 2) : body;
  }

  forget(newest) {
    if (this.stretches.size <= MAX_STRETCHES) return;
    const far = [...this.stretches.keys()].sort((a, b) => Math.abs(b - newest) - Math.abs(a - newest));
    for (const number of far.slice(0, this.stretches.size - MAX_STRETCHES)) this.stretches.delete(number);
  }

  /** The city at this moment: `{cars, boxes, colours, silent}`; null while it is on its way. */
  now() {
    const stretch = this.stretchAt(this.t_s);
    if (!stretch?.frames) return null;
    const { before, after } = this.around(stretch, this.t_s);
    const colours = new Map();
    for (const change of stretch.signals) {
      if (change.t_s <= this.t_s + 0.05) colours.set(change.group, change.colour);
    }
    if (!before || this.t_s - before.t_s > GAP_S) return { cars: [], boxes: [], colours, silent: true };
    const share = after && after.t_s > before.t_s ? (this.t_s - before.t_s) / (after.t_s - before.t_s) : 0;
    const next = new Map(after?.cars.map((car) => [after.facts[car[0]].vehicle, car]) ?? []);
    const cars = before.cars.map((car) => {
      const facts = before.facts[car[0]];
      return between(facts, car, next.get(facts.vehicle), share);
    });
    return { cars, boxes: boxesAt(stretch, before), colours, silent: false };
  }

  /** The frames before and after a moment, each with its cars' facts. */
  around(stretch, t_s) {
    const at = lastUpTo(stretch.frames, t_s);
    let before = at < 0 ? null : framed(stretch, at);
    if (!before) {
      const earlier = this.stretchAt(t_s - STRETCH_S);
      if (earlier?.frames?.length) before = framed(earlier, earlier.frames.length - 1);
    }
    let after = at + 1 < stretch.frames.length ? framed(stretch, at + 1) : null;
    if (!after) {
      const later = this.stretchAt(t_s + STRETCH_S);
      if (later?.frames?.length) after = framed(later, 0);
    }
    if (before && after && after.t_s - before.t_s > GAP_S) after = null;
    // The stretch before was not read: what comes a tenth of a second later does.
    if (!before && after && after.t_s - t_s < GAP_S / 10) before = after;
    return { before, after };
  }

  /** The newest picture of a camera by this moment: `{t_s}`; null: there is none, or it is on its way. */
  pictureOf({ vehicle, camera }) {
    const present = this.stretchAt(this.t_s)?.pictures ?? [];
    const isOf = (picture) => picture.vehicle === vehicle && picture.camera === camera;
    return present.findLast((picture) => isOf(picture) && picture.t_s <= this.t_s + 0.05) ?? null;
  }

  /** Where each car came from: `{vehicle: [[x, y], ...]}` of the last seconds. */
  trails(span_s) {
    const found = new Map();
    for (const t_s of [this.t_s - STRETCH_S, this.t_s]) {
      const stretch = this.stretchAt(Math.max(0, t_s));
      if (!stretch?.frames || (t_s < 0 && this.t_s < STRETCH_S)) continue;
      for (const frame of stretch.frames) {
        if (frame.t_s < this.t_s - span_s || frame.t_s > this.t_s) continue;
        for (const car of frame.cars) {
          const { vehicle } = stretch.cars[car[0]];
          if (!found.has(vehicle)) found.set(vehicle, []);
          found.get(vehicle).push([car[1], car[2]]);
        }
      }
    }
    return found;
  }
}

function framed(stretch, number) {
  return { ...stretch.frames[number], facts: stretch.cars };
}

/** Number of the last frame at or before a time; -1: none. */
function lastUpTo(frames, t_s) {
  let [low, high] = [0, frames.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (frames[middle].t_s <= t_s) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

function boxesAt(stretch, before) {
  const present = stretch.frames.findLast((frame) => frame.t_s <= before.t_s && frame.boxes);
  return present?.boxes ?? before.boxes ?? [];
}

const JUMP_M = 0.5;

/** A car between two frames, by the names of the live one. */
function between(facts, start, end, share) {
  const [, x_m, y_m, yaw_rad, speed_mps, steering_rad, mode, alive, lights, stuck] = start;
  const car = { ...facts, x_m, y_m, yaw_rad, speed_mps, steering_rad, mode, alive, lights, stuck };
  if (!end || Math.hypot(end[1] - x_m, end[2] - y_m) > JUMP_M) return car;
  const turn = Math.atan2(Math.sin(end[3] - yaw_rad), Math.cos(end[3] - yaw_rad));
  return {
    ...car,
    x_m: x_m + share * (end[1] - x_m),
    y_m: y_m + share * (end[2] - y_m),
    yaw_rad: yaw_rad + share * turn,
  };
}
