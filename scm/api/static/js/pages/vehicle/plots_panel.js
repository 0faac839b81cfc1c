/** Command against response: throttle and speed, steering and what the wheels and the car make of it. */
import { useEffect, useRef, useState } from "preact/hooks";
import uPlot from "uplot";
import { html } from "scm/shared/html.js";
import { fixed } from "scm/shared/format.js";
import { useOld } from "scm/shell/store.js";
import { colours } from "scm/shell/theme.js";
import { fresh, reportedAt, reportsNow, SHOWN_S } from "scm/pages/vehicle/reports.js";

const DRAW_MS = 100;
const HEIGHT = 152;
const FONT = "11px system-ui, sans-serif";

const PLOTS = [
  {
    title: "Throttle and speed",
    series: [
      { name: "throttle", label: "command", scale: "share", ink: "--plot-command", digits: 2, unit: "" },
      { name: "speed", label: "speed", scale: "y", ink: "--plot-response", digits: 2, unit: " m/s" },
    ],
    least: 0.3,
  },
  {
    title: "Steering and turning",
    series: [
      { name: "steering", label: "command", scale: "share", ink: "--plot-command", digits: 2, unit: "" },
      { name: "angle", label: "wheels", scale: "y", ink: "--plot-response", digits: 1, unit: "°" },
      { name: "yawRate", label: "yaw rate", scale: "y", ink: "--plot-other", digits: 1, unit: "°/s", dash: [5, 4] },
    ],
    least: 10,
  },
];

export function PlotsPanel() {
  const late = useOld(reportedAt);
  const [paused, setPaused] = useState(false);
  return html`
    <section class="panel plots" aria-label="Command and response">
      <div class="panel-head">
        <h2>Command and response <small>last ${SHOWN_S} s</small></h2>
        <button class="small" aria-pressed=${paused} onClick=${() => setPaused(!paused)}>${paused ? "Go on" : "Pause"}</button>
      </div>
      <div class="moves" data-stale=${late}>
        ${PLOTS.map((plot) => html`<${Plot} key=${plot.title} plot=${plot} paused=${paused} />`)}
      </div>
    </section>
  `;
}

function Plot({ plot, paused }) {
  const box = useRef(null);
  const held = useRef(false);
  held.current = paused;
  const [newest, setNewest] = useState({});
  const dark = colours.value;
  useEffect(() => {
    const chart = new uPlot(optionsOf(plot, box.current), dataOf(plot), box.current);
    const fit = new ResizeObserver(() => chart.setSize({ width: box.current.clientWidth, height: HEIGHT }));
    fit.observe(box.current);
    let request = 0;
    let drawn = -Infinity;
    let shown = -1;
    const frame = (time) => {
      request = requestAnimationFrame(frame);
      if (held.current || time - drawn < DRAW_MS || fresh.peek() === shown) return;
      [drawn, shown] = [time, fresh.peek()];
      chart.setData(dataOf(plot));
      const now = reportsNow();
      setNewest(Object.fromEntries(plot.series.map(({ name }) => [name, now[name].at(-1)])));
    };
    request = requestAnimationFrame(frame);
    return () => {
      cancelAnimationFrame(request);
      fit.disconnect();
      chart.destroy();
    };
  }, [plot, dark]);
  const words = plot.series.map((one) => `${one.label} ${number(one, newest)}`).join(", ");
  return html`
    <figure data-plot=${plot.series[0].name}>
      <figcaption>
        <span>${plot.title}</span>
        ${plot.series.map(
          (one) => html`
            <span class="key" data-ink=${one.ink} data-dash=${Boolean(one.dash)}><i></i>${one.label} <b>${number(one, newest)}</b></span>
          `,
        )}
      </figcaption>
      <div ref=${box} class="chart" role="img" aria-label="${plot.title}, now: ${words}"></div>
    </figure>
  `;
}

function number({ name, digits, unit }, newest) {
  return fixed(newest[name], digits, unit);
}

/** Columns of a plot; time counts back from the newest report. */
function dataOf(plot) {
  const now = reportsNow();
  const end = now.t.at(-1) ?? 0;
  return [now.t.map((t) => t - end), ...plot.series.map(({ name }) => now[name])];
}

function optionsOf(plot, box) {
  const style = getComputedStyle(box);
  const ink = (name) => resolved(box, name);
  const axis = { stroke: style.color, font: FONT, ticks: { show: false }, grid: { stroke: ink("--line"), width: 1 } };
  const wide = (low, high) => Math.max(plot.least, Math.abs(low ?? 0), Math.abs(high ?? 0)) * 1.1;
  return {
    width: box.clientWidth || 400,
    height: HEIGHT,
    legend: { show: false },
    cursor: { y: false, points: { show: false } },
    scales: {
      x: { time: false, range: () => [-SHOWN_S, 0] },
      y: { range: (_, low, high) => [-wide(low, high), wide(low, high)] },
      share: { range: () => [-1.1, 1.1] },
    },
    axes: [
      { ...axis, values: (_, ticks) => ticks.map((t) => (t ? `${t} s` : "now")), size: 24 },
      { ...axis, scale: "y", size: 44 },
      { ...axis, scale: "share", side: 1, size: 40, grid: { show: false } },
    ],
    series: [
      {},
      ...plot.series.map((one) => ({
        scale: one.scale,
        stroke: ink(one.ink),
        width: one.scale === "share" ? 1.25 : 2,
        dash: one.dash,
        points: { show: false },
        spanGaps: false,
      })),
    ],
  };
}

/** A colour of the style sheet as a canvas takes it: light or dark is settled by then. */
function resolved(box, name) {
  const probe = document.createElement("span");
  probe.style.color = `var(${name})`;
  box.append(probe);
  const { color } = getComputedStyle(probe);
  probe.remove();
  return color;
}
