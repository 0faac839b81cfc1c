/** What every plot of a report needs: its width on the screen, scales, ticks, lines with gaps. */
import { useLayoutEffect, useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";

/** @returns `[ref, width]`: the width [px] of the element that gets the ref, followed as it changes. */
export function useWidth(least = 260) {
  const ref = useRef(null);
  const [width, setWidth] = useState(least); // until it is measured, before anybody sees it
  useLayoutEffect(() => {
    const measure = () => setWidth(Math.max(least, Math.floor(ref.current?.clientWidth ?? least)));
    measure();
    const watch = new ResizeObserver(measure);
    watch.observe(ref.current);
    return () => watch.disconnect();
  }, []);
  return [ref, width];
}

/** A scale from `low..high` to `a..b`; `at.inverse` goes back. */
export function scale(low, high, a, b) {
  const wide = high - low || 1;
  const at = (value) => a + ((value - low) / wide) * (b - a);
  at.inverse = (place) => low + ((place - a) / (b - a || 1)) * wide;
  at.low = low;
  at.high = high;
  return at;
}

/** Round numbers between two ends, about so many. */
export function ticks(low, high, about = 5) {
  const unrounded = (high - low) / about || 1;
  const power = 10 ** Math.floor(Math.log10(unrounded));
  const step = [1, 2, 5, 10].find((times) => times * power >= unrounded) * power;
  const first = Math.ceil(low / step - 1e-9);
  const found = [];
  for (let k = first; k * step <= high + 1e-9 * step; k++) found.push(Number((k * step).toPrecision(10)));
  return found;
}

/** Least and most of numbers, those unknown left out; `through` widens them to hold it. */
export function ends(lists, through = null) {
  let low = through ?? Infinity;
  let high = through ?? -Infinity;
  for (const list of lists) {
    for (const value of list) {
      if (value === null || !Number.isFinite(value)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return low <= high ? [low, high] : [0, 1];
}

/** Grid lines with their numbers, and what the axes are. */
export function Grid({ x, y, box, across, up, countX = 6, countY = 4, write = String }) {
  const { left, right, top, bottom } = box;
  return html`
    <g class="grid">
      ${ticks(y.low, y.high, countY).map(
        (value) => html`
          <path d="M${left} ${y(value).toFixed(1)}H${right}" />
          <text x=${left - 6} y=${y(value) + 4} text-anchor="end">${write(value)}</text>
        `,
      )}
      ${ticks(x.low, x.high, countX).map(
        (value) => html`
          <path d="M${x(value).toFixed(1)} ${top}V${bottom}" />
          <text x=${x(value)} y=${bottom + 15} text-anchor="middle">${write(value)}</text>
        `,
      )}
      <text class="axis" x=${right} y=${bottom + 31} text-anchor="end">${across}</text>
      <text class="axis" x=${left} y=${top - 8}>${up}</text>
    </g>
  `;
}
