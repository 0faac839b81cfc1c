/** Changes and versions of one car over time: a band is the 90 % interval in which a change began. */
import { useLayoutEffect, useRef, useState } from "preact/hooks";
import { moment } from "scm/shared/format.js";
import { html } from "scm/shared/html.js";

const HEIGHT = 46;
const MARGIN = 12;
const ROOM = 0.06; // of the whole, before the first change

export function TimeLine({ car }) {
  const ref = useRef(null);
  const [width, setWidth] = useState(300);
  useLayoutEffect(() => {
    const watch = new ResizeObserver(() => setWidth(Math.max(200, ref.current.clientWidth)));
    watch.observe(ref.current);
    return () => watch.disconnect();
  }, []);
  const made = car.versions.filter(({ number }) => number > 0);
  const starts = [...car.changes.map((one) => one.since_low_ns), ...made.map((one) => one.made_ns)];
  const end = car.t_ns;
  const begin = Math.min(...starts) - ROOM * Math.max(1e9, end - Math.min(...starts));
  const x = (t_ns) => MARGIN + ((t_ns - begin) / (end - begin)) * (width - 2 * MARGIN);
  const words = [
    ...car.changes.map((one) => `changed at ${moment(one.since_ns)}`),
    ...made.map((one) => `version ${one.number} found at ${moment(one.made_ns)}`),
  ];
  return html`
    <figure class="time-line" ref=${ref}>
      <svg width=${width} height=${HEIGHT} role="img" aria-label="Over time: ${words.join(", ")}">
        <path class="axis" d="M${MARGIN} 22H${width - MARGIN}" />
        ${car.changes.map((one) => html`
          <rect class="change" x=${x(one.since_low_ns)} y="12" width=${Math.max(3, x(one.since_high_ns) - x(one.since_low_ns))} height="20" rx="1.5">
            <title>changed at ${moment(one.since_ns)}</title>
          </rect>
        `)}
        ${made.map((one) => html`
          <g class="version" transform="translate(${x(one.made_ns)} 22)"><circle r="8" /><text y="3.6">${one.number}</text><title>version ${one.number} found at ${moment(one.made_ns)}</title></g>
        `)}
        <text x=${MARGIN} y=${HEIGHT - 2}>${moment(begin)}</text>
        <text x=${width - MARGIN} y=${HEIGHT - 2} text-anchor="end">${moment(end)}</text>
      </svg>
      <figcaption class="legend-line"><span class="key change">began to differ</span>${made.length > 0 && html`<span class="key version">version found</span>`}</figcaption>
    </figure>
  `;
}
