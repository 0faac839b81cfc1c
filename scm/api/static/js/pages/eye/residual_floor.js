/** Residuals on the floor: an arrow from each measured place, many times as long as the error. */
import { useEffect, useRef, useState } from "preact/hooks";
import { readBox } from "scm/shared/drawing.js";
import { html } from "scm/shared/html.js";
import { colours } from "scm/shell/theme.js";

const ROADS = "/api/v1/map.svg";
const LONGEST_M = 0.16; // what the 95th of 100 arrows measures on the floor
const STEPS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const BAR_SHARE = 0.16;

export function ResidualFloor({ samples }) {
  const canvas = useRef(null);
  const [box, setBox] = useState(null);
  const gain = gainOf(samples);
  useEffect(() => void readBox(ROADS).then(setBox, () => {}), []);
  useEffect(() => {
    if (!box) return undefined;
    const repaint = () => draw(canvas.current, box, samples, gain);
    repaint();
    const watcher = new ResizeObserver(repaint);
    watcher.observe(canvas.current);
    return () => watcher.disconnect();
  }, [box, samples, gain, colours.value]);
  const shape = box ? { "--shape": `${box.width} / ${box.height}` } : {};
  return html`
    <div class="sheet" style=${shape}>
      ${box && html`<img class="roads" src=${ROADS} alt="" draggable="false" />`}
      <canvas
        ref=${canvas}
        role="img"
        data-arrows=${samples.length}
        aria-label="Floor map with ${samples.length} residuals as arrows, ${gain} times enlarged; the table shows the same in numbers"
      ></canvas>
    </div>
    <p class="note">
      ${samples.length ? `Arrows are ${gain} times as long as the error, from the measured place away from the truth; old ones fade.` : "No residuals yet."}
    </p>
  `;
}

/** How many times to enlarge: a round number at which the long arrows fit between the lanes. */
function gainOf(samples) {
  const far = samples.map((one) => Math.hypot(one.x_mm, one.y_mm)).toSorted((a, b) => a - b);
  const long_m = (far[Math.ceil(0.95 * far.length) - 1] ?? 1) / 1000;
  return STEPS.findLast((step) => step * long_m <= LONGEST_M) ?? 1;
}

function draw(canvas, box, samples, gain) {
  if (!canvas) return; // the page was left while its floor was read
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  const paper = canvas.getContext("2d");
  paper.setTransform(ratio, 0, 0, ratio, 0, 0);
  paper.clearRect(0, 0, width, height);
  const scale = Math.min(width / box.width, height / box.height);
  const left = (width - scale * box.width) / 2 - scale * box.left;
  const top = (height - scale * box.height) / 2 - scale * box.top;
  const newest = Math.max(...samples.map((one) => one.t_ns));
  const oldest = Math.min(...samples.map((one) => one.t_ns));
  for (const one of samples) {
    paper.globalAlpha = 0.35 + (0.6 * (one.t_ns - oldest)) / Math.max(1, newest - oldest);
    const from = [left + scale * one.x_m, top - scale * one.y_m];
    const reach = (gain * scale) / 1000;
    arrow(paper, from, [from[0] + reach * one.x_mm, from[1] - reach * one.y_mm], one);
  }
  paper.globalAlpha = 1;
  bar(paper, { width, height, scale, gain });
}

const GOOD_MM = 5;
const FAIR_MM = 10;

/** Blue, amber, red-violet: distinguishable for colour-blind people, and longer anyway. */
function shade(mm) {
  if (mm <= GOOD_MM) return "#4aa3ff";
  return mm <= FAIR_MM ? "#ffb000" : "#ff4f9a";
}

function arrow(paper, from, to, one) {
  const colour = shade(Math.hypot(one.x_mm, one.y_mm));
  const angle = Math.atan2(to[1] - from[1], to[0] - from[0]);
  const head = Math.min(5, 0.6 * Math.hypot(to[0] - from[0], to[1] - from[1]));
  paper.beginPath();
  paper.moveTo(...from);
  paper.lineTo(...to);
  for (const side of [-2.6, 2.6]) {
    paper.moveTo(...to);
    paper.lineTo(to[0] + head * Math.cos(angle + side), to[1] + head * Math.sin(angle + side));
  }
  paper.lineCap = "round";
  paper.lineWidth = 1.6;
  paper.strokeStyle = colour;
  paper.stroke();
}

/** A bar that is so many millimetres of error long, and what the colours mean. */
function bar(paper, { width, height, scale, gain }) {
  const px_per_mm = (scale * gain) / 1000;
  const mm = STEPS.findLast((step) => step * px_per_mm <= BAR_SHARE * width) ?? 1;
  const long = mm * px_per_mm;
  const legend = [[`≤ ${GOOD_MM} mm`, 0], [`≤ ${FAIR_MM} mm`, FAIR_MM], ["more", FAIR_MM + 1]];
  const wide = Math.max(long + 60, 190) + 12;
  const [x, y] = [10, height - 62];
  paper.fillStyle = "rgba(13, 18, 24, 0.82)";
  paper.beginPath();
  paper.roundRect(x, y, wide, 52, 8);
  paper.fill();
  paper.fillStyle = paper.strokeStyle = "#e8ecf1";
  paper.lineWidth = 1.5;
  paper.font = "12px system-ui, sans-serif";
  paper.textAlign = "left";
  paper.textBaseline = "middle";
  paper.beginPath();
  for (const end of [0, long]) {
    paper.moveTo(x + 12 + end, y + 9);
    paper.lineTo(x + 12 + end, y + 17);
  }
  paper.moveTo(x + 12, y + 13);
  paper.lineTo(x + 12 + long, y + 13);
  paper.stroke();
  paper.fillText(`${mm} mm`, x + 18 + long, y + 13);
  legend.forEach(([text, value], i) => {
    const at = x + 12 + i * 64;
    paper.fillStyle = shade(value);
    paper.fillRect(at, y + 26, 54, 3);
    paper.fillStyle = "#e8ecf1";
    paper.font = "11px system-ui, sans-serif";
    paper.fillText(text, at, y + 39);
  });
}
