/**
 * Draws the timing diagram.
 *
 * Above, a row a ring: the phases that it served one after the other, each with its green, its yellow
 * and its red clear; where all rings cross to other phases stands a barrier. Below, a row a phase. As
 * on paper, green is a full bar, yellow a hatched one and red a line: the shape shows what the colour
 * does. Right of now stands what the timetable or the policy foresees, paler.
 */
import { LETTERS, plain } from "scm/pages/signals/words.js";

const AXIS = 22;
const LEAST_ROW = 36;
const MOST_ROW = 56;
const SPLIT = 12;
const BELOW = 6;
const TICKS_S = [5, 10, 15, 30, 60, 120];
const LEAST_LETTER_PX = 13;

const left = (width) => (width < 560 ? 84 : 116);

/** Rings as rows, `[{name, phases}]`: the widest section decides how many. */
export function ringsOf(site) {
  const sections = site?.rings ?? [];
  const count = Math.max(0, ...sections.map((section) => section.length));
  const rings = Array.from({ length: count }, (_, at) => ({
    name: count > 1 ? `Ring ${at + 1}` : "Ring",
    phases: sections.flatMap((section) => section[at] ?? []),
  }));
  return { rings, sections };
}

const rowsOf = (site, current) => ringsOf(site).rings.length + (current?.groups.length ?? 2);

/** The least height that the diagram needs; with more, its rows are higher. */
export function heightOf(site, current) {
  return AXIS + SPLIT + BELOW + LEAST_ROW * rowsOf(site, current);
}

function rowOf(height, site, current) {
  const room = (height - AXIS - SPLIT - BELOW) / rowsOf(site, current);
  return Math.floor(Math.min(MOST_ROW, Math.max(LEAST_ROW, room)));
}

/** @param {{now: number, from: number, until: number}} view in seconds of the controller's clock. */
export function paint(canvas, view, { current, site, status, bars }) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (!width || !height) return;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const paper = canvas.getContext("2d");
  paper.setTransform(ratio, 0, 0, ratio, 0, 0);
  paper.clearRect(0, 0, width, height);
  const origin = left(width);
  const scale = (width - origin - 4) / (view.until - view.from);
  const x = (t) => origin + (t - view.from) * scale;
  const row = rowOf(height, site, current);
  const sheet = { paper, width, height, origin, x, view, row, bar: Math.round((2 / 3) * row), ink: inkOf(canvas) };
  const { rings } = ringsOf(site);
  const times = new Map((site?.phases ?? []).map((phase) => [phase.group, phase]));
  const coming = comingOf(status, current, view);
  drawAxis(sheet);
  paper.save();
  paper.beginPath();
  paper.rect(origin, 0, width - origin, height);
  paper.clip();
  rings.forEach((ring, at) => drawRing(sheet, ring, AXIS + row * at, { bars, times, coming }));
  const below = AXIS + row * rings.length + SPLIT;
  current.groups.forEach((group, at) => {
    drawPhase(sheet, group, below + row * at, { bars, times, coming, current });
  });
  drawBarriers(sheet, barriersOf(site, bars, coming, view), AXIS + row * rings.length);
  drawNow(sheet);
  paper.restore();
  rings.forEach((ring, at) => drawName(sheet, ring.name, AXIS + row * at, true));
  current.groups.forEach((group, at) => drawName(sheet, plain(group.group), below + row * at, false));
}

function inkOf(canvas) {
  const style = getComputedStyle(canvas);
  const of = (name) => style.getPropertyValue(name).trim();
  const light = document.documentElement.dataset.theme === "light";
  return {
    text: light ? "#17202b" : "#e8ecf1",
    muted: light ? "#5a6675" : "#93a0b0",
    line: light ? "#dbe1e8" : "#28323f",
    green: light ? "#15803d" : "#2fbf80",
    onGreen: light ? "#ffffff" : "#03200f",
    yellow: light ? "#d99a00" : "#f0b94a",
    red: light ? "#c9302a" : "#ff6a64",
    clear: light ? "#e6b3b0" : "#6d3532",
    now: light ? "#1b63cf" : "#6aa8ff",
    ground: light ? "#ffffff" : "#151b23",
    font: of("font-family") || "system-ui, sans-serif",
  };
}

/**
 * Greens from now on, of each group: `{group, start, end}` in seconds; end null: nobody knows. A group of turns
 * that follow each other stays green between them.
 */
export function comingOf(status, current, view) {
  if (!current.fresh || current.mode === "flash") return [];
  const lit = current.groups.filter(({ colour }) => colour === "green");
  let before = new Map(lit.map(({ group }) => [group, { group, start: view.now }]));
  const greens = new Set();
  for (const turn of status?.turns ?? []) {
    const following = new Map();
    for (const group of turn.groups) {
      const green = before.get(group) ?? { group, start: turn.start_ns / 1e9 };
      green.end = turn.end_ns === null ? null : turn.end_ns / 1e9;
      following.set(group, green);
      greens.add(green);
    }
    before = following;
  }
  return [...greens].filter((green) => green.end === null || green.end > view.now);
}

function drawAxis({ paper, width, height, origin, x, view, ink }) {
  const span = view.until - view.from;
  const room = (width - origin) / (width < 560 ? 5 : 10);
  const step = TICKS_S.find((s) => (s / span) * (width - origin) >= room) ?? TICKS_S.at(-1);
  paper.font = `11px ${ink.font}`;
  paper.textAlign = "center";
  paper.textBaseline = "middle";
  const first = Math.ceil((view.from - view.now) / step) * step;
  for (let at = first; at <= view.until - view.now; at += step) {
    const px = x(view.now + at);
    paper.strokeStyle = ink.line;
    paper.beginPath();
    paper.moveTo(px + 0.5, AXIS - 4);
    paper.lineTo(px + 0.5, height);
    paper.stroke();
    paper.fillStyle = at === 0 ? ink.now : ink.muted;
    const text = at === 0 ? "now" : Math.abs(at) < 60 ? `${at > 0 ? "+" : "−"}${Math.abs(at)} s` : minutes(at);
    if (px > origin + 12 && px < width - 14) paper.fillText(text, px, AXIS / 2 - 1);
  }
}

function minutes(at) {
  const whole = Math.abs(at);
  return `${at > 0 ? "+" : "−"}${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

function drawName({ paper, origin, row, ink }, name, top, strong) {
  paper.font = `${strong ? 600 : 500} 12px ${ink.font}`;
  paper.textAlign = "left";
  paper.textBaseline = "middle";
  paper.fillStyle = strong ? ink.text : ink.muted;
  paper.fillText(name, 0, top + row / 2, origin - 8);
}

function drawNow({ paper, height, x, view, ink }) {
  paper.strokeStyle = ink.now;
  paper.lineWidth = 2;
  paper.beginPath();
  paper.moveTo(x(view.now), AXIS - 4);
  paper.lineTo(x(view.now), height);
  paper.stroke();
  paper.lineWidth = 1;
}

function hatch(paper, fromX, top, width, height, colour) {
  paper.save();
  paper.beginPath();
  paper.rect(fromX, top, width, height);
  paper.clip();
  paper.globalAlpha *= 0.35;
  paper.fillStyle = colour;
  paper.fillRect(fromX, top, width, height);
  paper.globalAlpha /= 0.35;
  paper.strokeStyle = colour;
  paper.lineWidth = 2;
  for (let at = fromX - height - ((fromX - height) % 5); at < fromX + width; at += 5) {
    paper.beginPath();
    paper.moveTo(at, top + height);
    paper.lineTo(at + height, top);
    paper.stroke();
  }
  paper.restore();
}

/** One colour from `from` to `to`, in the shape of that colour. */
function drawBar({ paper, x, row, bar, ink, view }, colour, from, to, top, ...labels) {
  const [a, b] = [Math.max(x(from), x(view.from)), Math.min(x(to), x(view.until))];
  if (b <= a) return;
  const y = top + (row - bar) / 2;
  if (colour === "green") {
    paper.fillStyle = ink.green;
    paper.fillRect(a, y, b - a, bar);
  } else if (colour === "yellow") {
    hatch(paper, a, y, b - a, bar, ink.yellow);
  } else if (colour === "flashing_red") {
    hatch(paper, a, y + 5, b - a, bar - 10, ink.red);
  } else if (colour === "clear") {
    paper.fillStyle = ink.clear;
    paper.fillRect(a, y + 5, b - a, bar - 10);
  } else {
    paper.fillStyle = colour === "dark" ? ink.muted : ink.red;
    paper.fillRect(a, y + bar / 2 - 1, b - a, 2);
  }
  if (b - a > LEAST_LETTER_PX) write(paper, ink, colour === "green" ? ink.onGreen : ink.text, labels, a, b, y + bar / 2);
}

/** The first of some texts that fits between `a` and `b`; none: nothing. */
function write(paper, ink, colour, texts, a, b, y) {
  paper.font = `650 11px ${ink.font}`;
  paper.textAlign = "center";
  paper.textBaseline = "middle";
  paper.fillStyle = colour;
  const text = texts.find((one) => paper.measureText(one).width < b - a - 4);
  if (!text) return;
  if (colour === ink.text) {
    paper.strokeStyle = ink.ground; // so that a line behind it does not strike it through
    paper.lineWidth = 4;
    paper.strokeText(text, (a + b) / 2, y + 0.5);
    paper.lineWidth = 1;
  }
  paper.fillText(text, (a + b) / 2, y + 0.5);
}

function drawComing(sheet, green, top, times, label) {
  const { paper, x, row, bar, ink, view } = sheet;
  const from = Math.max(green.start, view.now);
  const to = green.end ?? view.until;
  if (to <= from) return;
  paper.save();
  paper.globalAlpha = 0.38;
  drawBar(sheet, "green", from, to, top);
  if (green.end !== null && times) {
    drawBar(sheet, "yellow", to, to + times.yellow_s, top);
    drawBar(sheet, "clear", to + times.yellow_s, to + times.yellow_s + times.red_clear_s, top);
  }
  paper.restore();
  paper.save();
  paper.setLineDash([4, 3]);
  paper.strokeStyle = ink.green;
  paper.strokeRect(x(from) + 0.5, top + (row - bar) / 2 + 0.5, x(to) - x(from) - 1, bar - 1);
  paper.restore();
  if (label && green.start > view.now) {
    write(paper, ink, ink.text, [label], x(from), x(Math.min(to, view.until)), top + row / 2);
  }
}

function drawRing(sheet, ring, top, { bars, times, coming }) {
  const { view } = sheet;
  for (const group of ring.phases) {
    const list = bars.get(group) ?? [];
    list.forEach((bar, at) => {
      const end = bar.end ?? view.now;
      if (end < view.from - 20 || bar.start > view.until) return;
      if (bar.colour === "green") {
        const [name, lasted] = [plain(group), `${Math.round(end - bar.start)} s`];
        drawBar(sheet, "green", bar.start, end, top, `${name} ${lasted}`, name, lasted);
      } else if (bar.colour === "yellow") {
        drawBar(sheet, "yellow", bar.start, end, top);
      } else if (bar.colour === "red" && list[at - 1]?.colour === "yellow") {
        const clear = Math.min(end, bar.start + (times.get(group)?.red_clear_s ?? 0));
        drawBar(sheet, "clear", bar.start, clear, top);
      } else if (bar.colour === "flashing_red") {
        drawBar(sheet, "flashing_red", bar.start, end, top);
      }
    });
    for (const green of coming) {
      if (green.group === group) drawComing(sheet, green, top, times.get(group), plain(group));
    }
  }
}

function drawPhase(sheet, group, top, { bars, times, coming, current }) {
  const { view } = sheet;
  for (const bar of bars.get(group.group) ?? []) {
    const end = bar.end ?? view.now;
    if (end < view.from || bar.start > view.until) continue;
    drawBar(sheet, bar.colour, bar.start, end, top, LETTERS[bar.colour]);
  }
  if (!current.fresh) return;
  for (const green of coming) {
    if (green.group === group.group) drawComing(sheet, green, top, times.get(group.group), "");
  }
  drawGuaranteedTime(sheet, group, top, current);
}

/** Guaranteed times of the present colour: from the earliest to the latest end, and the likely one. */
function drawGuaranteedTime({ paper, x, view, ink }, group, top, current) {
  if (group.min_s === null || current.t_ns === null) return;
  const base = current.t_ns / 1e9;
  const from = x(base + group.min_s);
  const to = group.max_s === null ? x(view.until) : x(base + group.max_s);
  const y = top + 3.5;
  paper.strokeStyle = ink.text;
  paper.lineWidth = 1.5;
  paper.beginPath();
  paper.moveTo(from, y - 3);
  paper.lineTo(from, y + 3);
  paper.moveTo(from, y);
  paper.lineTo(to, y);
  if (group.max_s !== null) {
    paper.moveTo(to, y - 3);
    paper.lineTo(to, y + 3);
  }
  paper.stroke();
  paper.lineWidth = 1;
  if (group.likely_s === null) return;
  const at = x(base + group.likely_s);
  paper.fillStyle = ink.text;
  paper.strokeStyle = ink.ground;
  paper.beginPath();
  paper.moveTo(at, y - 5);
  paper.lineTo(at + 5, y);
  paper.lineTo(at, y + 5);
  paper.lineTo(at - 5, y);
  paper.closePath();
  paper.fill();
  paper.stroke();
}

/**
 * The times in view at which all rings crossed or will cross a barrier: the next green is one of another
 * section; at a junction of one single ring, its sequence begins again.
 */
export function barriersOf(site, bars, coming, view) {
  const { sections } = ringsOf(site);
  const sectionOf = new Map(sections.flatMap((section, at) => section.flat().map((group) => [group, at])));
  const single = sections.length === 1 && sections[0].length === 1 ? sections[0][0] : null;
  const starts = [];
  for (const [group, list] of bars) {
    for (const bar of list) if (bar.colour === "green") starts.push([bar.start, group]);
  }
  for (const green of coming) {
    if (green.start > view.now) starts.push([green.start, green.group]);
  }
  starts.sort((one, other) => one[0] - other[0]);
  const isCrossed = ([, one], [, other]) =>
    single ? single.indexOf(other) <= single.indexOf(one) : sectionOf.get(one) !== sectionOf.get(other);
  return starts
    .filter((start, at) => at > 0 && isCrossed(starts[at - 1], start))
    .map(([t]) => t)
    .filter((t) => t >= view.from && t <= view.until);
}

function drawBarriers({ paper, x, view, ink }, times, bottom) {
  paper.lineWidth = 1.5;
  for (const t of times) {
    const px = Math.round(x(t)) - 2.5;
    paper.strokeStyle = t > view.now ? ink.muted : ink.text;
    for (const shift of [0, 3]) {
      paper.beginPath();
      paper.moveTo(px - shift, AXIS);
      paper.lineTo(px - shift, bottom);
      paper.stroke();
    }
  }
  paper.lineWidth = 1;
}

/** @returns the bar under a point of the canvas, with its group; null: there is none. */
export function barAt(px, py, { width, height }, view, { current, site, bars }) {
  const origin = left(width);
  const row = rowOf(height, site, current);
  if (px < origin) return null;
  const t = view.from + ((px - origin) / (width - origin - 4)) * (view.until - view.from);
  const { rings } = ringsOf(site);
  const below = AXIS + row * rings.length + SPLIT;
  const ring = rings[Math.floor((py - AXIS) / row)];
  const phase = current.groups[Math.floor((py - below) / row)];
  const groups = py < below - SPLIT ? (ring?.phases ?? []) : phase ? [phase.group] : [];
  const wanted = py < below - SPLIT ? ["green", "yellow", "flashing_red"] : null;
  for (const group of groups) {
    const found = (bars.get(group) ?? []).find(
      (bar) => bar.start <= t && t < (bar.end ?? view.now) && (!wanted || wanted.includes(bar.colour)),
    );
    if (found) return { ...found, group };
  }
  return null;
}
