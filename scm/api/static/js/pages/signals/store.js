/** What the page knows of its junction beside the live stream: site, plans, bars of the last minutes. */
import { effect, signal } from "@preact/signals";
import { notify } from "scm/shell/api.js";
import { link, signals, signalsAt, topic } from "scm/shell/store.js";
import { placed } from "scm/shared/base.js";

/** The junction that is looked at, by name; null before any is known. */
export const junction = signal(null);

/** Its `SignalSite`, its plans, what SPaT published against what happened, the monitor's reports. */
export const site = signal(null);
export const plans = signal([]);
export const score = signal(null);
export const verdicts = signal([]);

/** Why something could not be read; empty: all was. */
export const trouble = signal("");

const AGAIN_EVERY_MS = 5000;
const HISTORY_S = 600;

/** Group to its bars `{colour, start, end}`, oldest first, in seconds of the controller's clock. */
export const bars = { of: new Map(), t: null, junction: null };

/** Counts up when bars were read anew. */
export const barsRead = signal(0);

export const row = () => signals.value.find((one) => one.junction === junction.value) ?? null;

export const status = () =>
  (topic("signal_status").value ?? []).find((one) => one.junction === junction.value) ?? null;

/** The controller's clock now [s]; null: nothing received. */
export function clockNow() {
  const current = row();
  if (!current?.fresh || current.t_ns === null) return null;
  const passed_s = Math.min(1, Math.max(0, (performance.now() - signalsAt.value) / 1000));
  return current.t_ns / 1e9 + passed_s;
}

export async function read(path) {
  const response = await fetch(placed(`/api/v1${path}`));
  const body = await response.json();
  if (!response.ok) throw Object.assign(new Error(body.detail || body.title), { status: response.status });
  return { body, tag: response.headers.get("ETag") };
}

/** Look at a junction: read everything that the stream does not carry. */
export async function look(name) {
  junction.value = name;
  site.value = null;
  plans.value = [];
  score.value = null;
  verdicts.value = [];
  bars.of = new Map();
  bars.t = null;
  await Promise.all([readSite(name), readBars(name), readScore(name)]);
}

async function readSite(name) {
  for (;;) {
    try {
      const found = (await read(`/signals/${name}/site`)).body;
      if (junction.value !== name) return;
      site.value = found;
      trouble.value = "";
      return await readPlans();
    } catch (error) {
      if (junction.value !== name) return;
      trouble.value = error.message;
      await new Promise((resolve) => setTimeout(resolve, 2000));
    }
  }
}

export async function readPlans(isRequested = true) {
  const name = junction.value;
  try {
    const { body } = await read(`/signals/${name}/plans?limit=200`);
    if (junction.value === name) plans.value = body.items;
  } catch (error) {
    if (isRequested) notify("error", error.message);
  }
}

async function readBars(name) {
  try {
    const { body } = await read(`/signals/${name}/history`);
    if (junction.value !== name) return;
    bars.of = new Map(
      body.groups.map(({ group, bars: found }) => [
        group,
        found.map((bar) => ({
          colour: bar.colour,
          start: bar.start_ns / 1e9,
          end: bar.end_ns === null ? null : bar.end_ns / 1e9,
        })),
      ]),
    );
    bars.t = body.t_ns === null ? null : body.t_ns / 1e9;
    bars.junction = name;
    barsRead.value += 1;
  } catch {
    // The stream continues from here: the past is missing, and the page shows how far it goes back.
  }
}

async function readScore(name) {
  try {
    const [current, faults] = await Promise.all([
      read(`/signals/${name}/promises`),
      read(`/signals/${name}/monitor`),
    ]);
    if (junction.value !== name) return;
    score.value = current.body;
    verdicts.value = faults.body.items;
  } catch {
    // Said by the banner when the server is gone; tried again soon.
  }
}

/** Extend the bars by the stream's newest state. */
function extend(current) {
  if (!current.fresh || current.t_ns === null || bars.junction !== current.junction) return;
  const t = current.t_ns / 1e9;
  if (bars.t !== null && (t < bars.t - 1 || t > bars.t + 2)) {
    bars.t = t;
    readBars(current.junction); // another controller, or a piece that was missed
    return;
  }
  bars.t = t;
  for (const { group, colour, since_ns } of current.groups) {
    if (!bars.of.has(group)) bars.of.set(group, []);
    const list = bars.of.get(group);
    const last = list.at(-1);
    const since = since_ns === null ? t : since_ns / 1e9;
    if (last && last.end === null && last.colour !== colour) last.end = since;
    if (!last || last.end !== null) list.push({ colour, start: since, end: null });
    while (list.length && list[0].end !== null && list[0].end < t - HISTORY_S) list.shift();
  }
}

/** Keep everything up to date for as long as the page is shown. */
export function keep() {
  let wasLost = false;
  const live = effect(() => {
    const current = row();
    if (current) extend(current);
  });
  const back = effect(() => {
    const lost = link.value === "lost";
    if (wasLost && link.value === "live" && junction.value) readBars(junction.value);
    if (lost) wasLost = true;
    else if (link.value === "live") wasLost = false;
  });
  const timer = setInterval(() => {
    if (junction.value) readScore(junction.value);
    if (site.value) readPlans(false); // others save and delete plans too
  }, AGAIN_EVERY_MS);
  return () => {
    live();
    back();
    clearInterval(timer);
  };
}
