/** The ring-and-barrier timing diagram: the last minutes, now, and the greens to come. */
import { effect, signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { now } from "scm/shell/store.js";
import { colours } from "scm/shell/theme.js";
import { barAt, barriersOf, comingOf, heightOf, paint, ringsOf } from "scm/pages/signals/diagram_paint.js";
import { bars, barsRead, clockNow, row, site, status } from "scm/pages/signals/store.js";
import { plain, WORDS } from "scm/pages/signals/words.js";

const SPANS_S = [30, 60, 90, 120, 300, 600];
const FUTURE = 0.3;
const PAN = 0.25;

/** How many seconds are shown, and how far the view is moved back from now [s]. */
const span = signal(window.innerWidth < 860 ? 60 : 90);
const back = signal(0);

/** What lies under the pointer, in words. */
const readout = signal("");

const zoom = (step) => {
  const at = SPANS_S.indexOf(span.value);
  span.value = SPANS_S[Math.max(0, Math.min(SPANS_S.length - 1, at + step))];
};
const pan = (share) => (back.value = Math.max(0, Math.min(600, back.value + share * span.value)));

const KEYS = {
  ArrowLeft: () => pan(PAN),
  ArrowRight: () => pan(-PAN),
  "+": () => zoom(-1),
  "-": () => zoom(1),
  Home: () => (back.value = 0),
};

/** @returns the part of time that is shown, in seconds of the controller's clock. */
function view() {
  const t = clockNow() ?? bars.t;
  if (t === null) return null;
  const until = t - back.value + FUTURE * span.value;
  return { now: t, from: until - span.value, until };
}

export function Diagram() {
  const canvas = useRef(null);
  useEffect(() => {
    const draw = () => {
      const current = row();
      const shown = view();
      if (!canvas.current || !current || !shown) return;
      paint(canvas.current, shown, { current, site: site.value, status: status(), bars: bars.of });
    };
    const stop = effect(() => {
      now.value, barsRead.value, colours.value, span.value, back.value, site.value;
      draw();
    });
    const watch = new ResizeObserver(draw);
    watch.observe(canvas.current);
    return () => {
      stop();
      watch.disconnect();
    };
  }, []);
  const onKey = (event) => {
    const act = KEYS[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act();
  };
  const height = heightOf(site.value, row());
  return html`
    <section class="panel diagram" aria-label="Timing diagram">
      <div class="panel-head">
        <h2>Timing <small>rings, barriers and phases</small></h2>
        <p class="readout" aria-live="off">${readout.value}</p>
        <div class="tools" role="group" aria-label="Time shown">
          <button class="small" aria-label="Earlier" onClick=${() => pan(PAN)}>◀</button>
          <button class="small" aria-label="Later" disabled=${back.value === 0} onClick=${() => pan(-PAN)}>▶</button>
          <button class="small" disabled=${back.value === 0} onClick=${() => (back.value = 0)}>Now</button>
          <button class="small" aria-label="Zoom out" disabled=${span.value === SPANS_S.at(-1)} onClick=${() => zoom(1)}>−</button>
          <output>${span.value < 120 ? `${span.value} s` : `${span.value / 60} min`}</output>
          <button class="small" aria-label="Zoom in" disabled=${span.value === SPANS_S[0]} onClick=${() => zoom(-1)}>+</button>
        </div>
      </div>
      <div class="sheet" style=${{ minHeight: `${height}px` }}>
        <canvas
          ref=${canvas}
          tabindex="0"
          role="img"
          aria-label=${inWords()}
          aria-describedby="diagram-rings"
          onKeyDown=${onKey}
          onPointerMove=${(event) => (readout.value = under(event, canvas.current))}
          onPointerLeave=${() => (readout.value = "")}
        ></canvas>
      </div>
      <p id="diagram-rings" class="hidden">${ringsInWords()}</p>
      <ul class="key" aria-hidden="true">
        <li><i data-sign="green"></i>green</li>
        <li><i data-sign="yellow"></i>yellow change</li>
        <li><i data-sign="clear"></i>red clear</li>
        <li><i data-sign="red"></i>red</li>
        <li><i data-sign="flash"></i>flashing red</li>
        <li><i data-sign="coming"></i>to come</li>
        <li><i data-sign="guaranteed"></i>SPaT: earliest to latest end</li>
        <li><i data-sign="likely"></i>likely end</li>
        <li><i data-sign="barrier"></i>barrier</li>
      </ul>
    </section>
  `;
}

function inWords() {
  const current = row();
  const shows = (current?.groups ?? []).map((one) => `${plain(one.group)} ${WORDS[one.colour] ?? "unknown"}`);
  return `Timing diagram: ${shows.join(", ")}; arrow keys move it, plus and minus zoom`;
}

/** Rings and barriers as they are drawn, for who does not see them. */
function ringsInWords() {
  now.value, barsRead.value;
  const [shown, current] = [view(), row()];
  if (!site.value || !shown || !current) return "";
  const { rings, sections } = ringsOf(site.value);
  const sequences = rings.map(({ name }, at) => {
    const parts = sections.map((section) => (section[at] ?? []).map(plain).join(", ") || "nobody");
    return `${name}: ${parts.join(", barrier, ")}.`;
  });
  const crossed = barriersOf(site.value, bars.of, comingOf(status(), current, shown), shown).map((t) => {
    const whole = Math.round(Math.abs(t - shown.now));
    return t > shown.now ? `in ${whole} s` : `${whole} s ago`;
  });
  return `${sequences.join(" ")} Barriers shown: ${crossed.join(", ") || "none"}.`;
}

function under(event, canvas) {
  const shown = view();
  const current = row();
  if (!shown || !current) return "";
  const box = canvas.getBoundingClientRect();
  const found = barAt(event.clientX - box.left, event.clientY - box.top, box, shown, {
    current,
    site: site.value,
    bars: bars.of,
  });
  if (!found) return "";
  const until = found.end ?? shown.now;
  const ago = Math.max(0, shown.now - found.start).toFixed(0);
  const lasted = `${(until - found.start).toFixed(1)} s`;
  const words = found.end === null ? `for ${lasted} now` : `for ${lasted}, began ${ago} s ago`;
  return `${plain(found.group)}: ${WORDS[found.colour]} ${words}`;
}
