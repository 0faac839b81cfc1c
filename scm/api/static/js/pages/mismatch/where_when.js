/** Where on the floor and when the simulator strays: a map and a time line that show the same moment. */
import { useMemo, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { area, ends, Grid, line, scale, useWidth } from "scm/pages/mismatch/plot.js";
import { short, unitText } from "scm/pages/mismatch/words.js";

const CLASSES = 9; // of colour; the middle one is no more than noise
const BAND_STDS = 2;
const WIDTHS = [5, 4, 3.2, 2.6, 1.6];

export function WhereWhen({ drawn }) {
  const [chosen, choose] = useState(0);
  const [side, setSide] = useState("before");
  const [at, setAt] = useState(null); // index of the moment looked at
  const residual = drawn.residuals[chosen];
  const moment = at === null ? null : Math.min(at, residual.t_s.length - 1);
  const bound = useMemo(() => colourBound(residual), [residual]);
  const shared = { drawn, residual, side, bound, at: moment, setAt };
  return html`
    <section class="panel where-when" aria-label="Where and when">
      <div class="panel-head">
        <h2>Where and when</h2>
        <div class="tabs" role="group" aria-label="Simulator">
          <button class="small" aria-pressed=${side === "before"} onClick=${() => setSide("before")}>Before</button>
          <button class="small" aria-pressed=${side === "after"} onClick=${() => setSide("after")}>After</button>
        </div>
      </div>
      <div class="tabs" role="group" aria-label="What is unexplained">
        ${drawn.residuals.map(
          (one, i) => html`
            <button key=${one.channel} class="small" aria-pressed=${i === chosen} onClick=${() => choose(i)}>
              ${one.channel}
            </button>
          `,
        )}
      </div>
      <div class="two">
        <${FloorMap} ...${shared} />
        <${TimeLine} ...${shared} />
      </div>
    </section>
  `;
}

/** Where colours end: the 98th percentile, and three standard deviations at least. */
function colourBound({ before, std }) {
  const sizes = before.filter((value) => value !== null).map(Math.abs).toSorted((a, b) => a - b);
  const stds = std.filter((value) => value !== null).toSorted((a, b) => a - b);
  const strong = sizes[Math.floor(0.98 * (sizes.length - 1))] ?? 0;
  return Math.max(strong, 3 * (stds[Math.floor(stds.length / 2)] ?? 0)) || 1;
}

function colourClass(value, std, bound) {
  const middle = (CLASSES - 1) / 2;
  if (Math.abs(value) <= BAND_STDS * (std ?? 0)) return middle;
  return Math.round((Math.max(-1, Math.min(1, value / bound)) + 1) * middle);
}

function FloorMap({ drawn, residual, side, bound, at, setAt }) {
  const [ref, width] = useWidth();
  const places = drawn.located.map((one) => one.where).filter(Boolean);
  const room = useMemo(() => roomOf(residual, places, width), [residual, width]);
  const way = useMemo(() => (room ? ways(residual, side, bound, room) : null), [residual, side, bound, room]);
  const onMove = (event) => {
    const box = event.currentTarget.getBoundingClientRect();
    setAt(nearest(residual, room, event.clientX - box.left, event.clientY - box.top));
  };
  const point = at === null ? null : [residual.x_m[at], residual.y_m[at]];
  return html`
    <figure ref=${ref}>
      ${room &&
      html`
        <svg
          class="floor"
          width=${width}
          height=${room.height}
          role="img"
          aria-label="Floor map of the unexplained ${residual.channel}"
          onPointerMove=${onMove}
          onPointerDown=${onMove}
        >
          ${places.map(
            (place) => html`
              <rect
                class="place"
                x=${room.x(place.x_m[0])}
                y=${room.y(place.y_m[1])}
                width=${room.x(place.x_m[1]) - room.x(place.x_m[0])}
                height=${room.y(place.y_m[0]) - room.y(place.y_m[1])}
              />
            `,
          )}
          ${way}
          <${ScaleBar} room=${room} />
          ${point &&
          point[0] !== null &&
          html`<circle class="moment" cx=${room.x(point[0])} cy=${room.y(point[1])} r="7" />`}
        </svg>
      `}
      <${Colours} residual=${residual} bound=${bound} />
    </figure>
  `;
}

function roomOf({ x_m, y_m }, places, width) {
  if (!width || !x_m.some((value) => value !== null)) return null;
  const [x0, x1] = ends([x_m, ...places.map((place) => place.x_m)]);
  const [y0, y1] = ends([y_m, ...places.map((place) => place.y_m)]);
  const pad = 16;
  const fits = Math.min((width - 2 * pad) / (x1 - x0 || 1), 340 / (y1 - y0 || 1));
  const height = Math.max(150, fits * (y1 - y0) + 2 * pad + 22);
  const left = (width - fits * (x1 - x0)) / 2;
  return {
    height,
    per_m: fits,
    x: (value) => left + (value - x0) * fits,
    y: (value) => pad + (y1 - value) * fits,
  };
}

/** The car's way, one path for each colour, the strongest drawn last. */
function ways(residual, side, bound, room) {
  const { x_m, y_m, t_s, std } = residual;
  const steps = t_s.slice(1).map((t, i) => t - t_s[i]).toSorted((a, b) => a - b);
  const gap = 5 * (steps[Math.floor(steps.length / 2)] ?? 1);
  const data = Array.from({ length: CLASSES }, () => "");
  for (let i = 0; i + 1 < t_s.length; i++) {
    const value = residual[side][i];
    const known = [x_m[i], y_m[i], x_m[i + 1], y_m[i + 1], value].every((one) => one !== null);
    if (!known || t_s[i + 1] - t_s[i] > gap) continue;
    data[colourClass(value, std[i], bound)] +=
      `M${room.x(x_m[i]).toFixed(1)} ${room.y(y_m[i]).toFixed(1)}` +
      `L${room.x(x_m[i + 1]).toFixed(1)} ${room.y(y_m[i + 1]).toFixed(1)}`;
  }
  const middle = (CLASSES - 1) / 2;
  return [...data.keys()]
    .toSorted((a, b) => Math.abs(a - middle) - Math.abs(b - middle))
    .map((kind) => {
      const wide = WIDTHS[Math.min(kind, CLASSES - 1 - kind)];
      return html`<path key=${kind} class="way d${kind}" d=${data[kind]} stroke-width=${wide} />`;
    });
}

function nearest({ x_m, y_m }, room, px, py) {
  let best = null;
  let least = Infinity;
  for (let i = 0; i < x_m.length; i++) {
    if (x_m[i] === null) continue;
    const far = (room.x(x_m[i]) - px) ** 2 + (room.y(y_m[i]) - py) ** 2;
    if (far < least) [least, best] = [far, i];
  }
  return best;
}

function ScaleBar({ room }) {
  const metres = [5, 2, 1, 0.5, 0.2, 0.1].find((one) => one * room.per_m < 120) ?? 0.1;
  const y = room.height - 8;
  return html`
    <g class="scale-bar">
      <path d="M12 ${y}h${metres * room.per_m}" />
      <text x=${18 + metres * room.per_m} y=${y + 4}>${metres} m</text>
    </g>
  `;
}

function Colours({ residual, bound }) {
  const cells = [...Array(CLASSES).keys()];
  return html`
    <figcaption class="colours">
      <span>−${short(bound)}</span>
      <svg width="144" height="12" aria-hidden="true">
        ${cells.map((kind) => html`<path class="d${kind}" d="M${16 * kind} 6h16" stroke-width="12" />`)}
      </svg>
      <span>+${short(bound)} ${unitText(residual.unit)}</span>
      <span class="muted">grey: no more than noise</span>
    </figcaption>
  `;
}

function TimeLine({ drawn, residual, side, at, setAt }) {
  const [ref, width] = useWidth();
  const height = 300;
  const box = { left: 56, right: width - 8, top: 24, bottom: height - 40 };
  const frame = useMemo(() => {
    const { t_s, before, std } = residual;
    const two = std.map((value) => (value === null ? null : BAND_STDS * value));
    const [low, high] = ends([before, two, two.map((value) => (value === null ? null : -value))], 0);
    const pad = 0.06 * (high - low);
    const x = scale(t_s[0], t_s.at(-1), box.left, box.right);
    return { x, y: scale(low - pad, high + pad, box.bottom, box.top), two };
  }, [residual, width]);
  const spans = drawn.located.flatMap((one) => one.when_s ?? []);
  const still = useMemo(() => width && lines(drawn, residual, side, frame, box, spans), [residual, side, frame]);
  const onMove = (event) => {
    const left = event.currentTarget.getBoundingClientRect().left;
    setAt(atTime(residual, frame.x.inverse(event.clientX - left)));
  };
  return html`
    <figure ref=${ref}>
      <svg
        class="time-line"
        width=${width}
        height=${height}
        role="img"
        aria-label="Unexplained ${residual.channel} against time, ${side}"
        onPointerMove=${onMove}
        onPointerDown=${onMove}
      >
        ${still}
        ${at !== null && html`<path class="cursor" d="M${frame.x(residual.t_s[at])} ${box.top}V${box.bottom}" />`}
      </svg>
      <input
        type="range"
        min="0"
        max=${residual.t_s.length - 1}
        value=${at ?? 0}
        aria-label="Moment of the recording"
        aria-valuetext=${said(residual, at, side)}
        onInput=${(event) => setAt(Number(event.target.value))}
      />
      <figcaption class="said">${said(residual, at, side)}</figcaption>
    </figure>
  `;
}

function lines(drawn, residual, side, { x, y, two }, box, spans) {
  const { t_s, channel, unit } = residual;
  const low = two.map((value) => (value === null ? null : -value));
  const clock = drawn.start_s ? `time since ${drawn.start_s} s [s]` : "time [s]";
  const up = `unexplained ${channel} [${unitText(unit)}]`;
  const other = side === "before" ? "after" : "before";
  return html`
    ${spans.map(
      ([from, to]) => html`
        <rect class="span" x=${x(from)} y=${box.top} width=${Math.max(2, x(to) - x(from))} height=${box.bottom - box.top} />
      `,
    )}
    <${Grid} x=${x} y=${y} box=${box} across=${clock} up=${up} write=${short} />
    <path class="noise" d=${area(t_s, low, two, x, y)} />
    <path class="curve faint ${other}" d=${line(t_s, residual[other], x, y)} />
    <path class="curve ${side}" d=${line(t_s, residual[side], x, y)} />
  `;
}

function atTime({ t_s }, t) {
  let low = 0;
  let high = t_s.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (t_s[middle] < t) low = middle + 1;
    else high = middle;
  }
  return low;
}

function said(residual, at, side) {
  if (at === null) return "Point at the map or the time line, or move the slider: both show the same moment.";
  const unit = unitText(residual.unit);
  const value = `${short(residual[side][at])} ± ${short(residual.std[at])} ${unit}`;
  const [x, y] = [residual.x_m[at], residual.y_m[at]];
  const place = x === null ? "" : ` at x ${short(x)} m, y ${short(y)} m`;
  return `${short(residual.t_s[at])} s${place}: ${residual.channel} ${value}`;
}
