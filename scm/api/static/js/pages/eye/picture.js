/** The picture panel: the live picture with its layers, zoom, and how old it is. */
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { clock, fixed, span } from "scm/shared/format.js";
import { EyePicture } from "scm/pages/eye/eye_picture.js";
import { chosenTag } from "scm/pages/eye/chosen.js";
import { live } from "scm/shell/store.js";

const LAYERS = { outline: "Outline", id: "Id", name: "Vehicle", axes: "Axes" };
const STEP = 1.5;

export function Picture({ camera }) {
  const canvas = useRef(null);
  const picture = useRef(null);
  const [drawn_t_ns, setDrawn] = useState(null);
  const [layers, setLayers] = useState({ outline: true, id: true, name: true, axes: false });
  const [zoom, setZoom] = useState(1);
  useEffect(() => {
    picture.current = new EyePicture(camera.camera, canvas.current, setDrawn);
    const watcher = new ResizeObserver(() => picture.current.draw());
    watcher.observe(canvas.current);
    return () => watcher.disconnect();
  }, []);
  useEffect(() => picture.current.update(camera), [camera.frame_t_ns, camera.tags_t_ns]);
  useEffect(() => picture.current.show(layers, chosenTag.value), [layers, chosenTag.value]);
  const act = (change) => {
    change(picture.current);
    setZoom(picture.current.zoom);
  };
  useWheel(canvas, act);
  const behind = behind_s(camera, drawn_t_ns);
  return html`
    <section class="panel eye-picture" aria-label="Picture">
      <div class="panel-head">
        <h2>Picture <small>${camera.tags.length} tags</small></h2>
        <span class="facts" title="exposure · from exposure to the Eye · how far the picture is behind the map">
          ${drawn_t_ns === null ? "waits for a picture" : `exposed ${clock(Number(drawn_t_ns))}`}
          ${` · ${fixed(camera.latency_ms, 0, " ms")} to the Eye · `}
          <span class=${behind > 1 ? "warn" : ""}>${`${span(behind)} old`}</span>
        </span>
      </div>
      ${camera.complaints.map(
        (fault) => html`<p key=${fault} class="camera-fault ${camera.good ? "" : "warn"}" role="status">${fault}</p>`,
      )}
      <canvas
        ref=${canvas}
        class="picture moves"
        data-stale=${behind > 1}
        tabindex="0"
        role="img"
        width=${camera.width_px ?? 16}
        height=${camera.height_px ?? 9}
        aria-label="Picture of camera ${camera.camera} with ${camera.tags.length} tags; plus and minus zoom, arrows move"
        data-frame=${drawn_t_ns}
        data-zoom=${zoom.toFixed(2)}
        onKeyDown=${(event) => onKey(event, act)}
        ...${dragging(act)}
      ></canvas>
      <div class="tools">
        <fieldset>
          <legend class="hidden">Layers</legend>
          ${Object.entries(LAYERS).map(
            ([name, title]) => html`
              <label key=${name}>
                <input
                  type="checkbox"
                  checked=${layers[name]}
                  onChange=${(event) => setLayers({ ...layers, [name]: event.currentTarget.checked })}
                />${title}
              </label>
            `,
          )}
        </fieldset>
        <span class="zoom">
          <button class="small" aria-label="Zoom out" onClick=${() => act((one) => one.zoomBy(1 / STEP))}>−</button>
          <output aria-label="Zoom">${`${zoom.toFixed(1)} ×`}</output>
          <button class="small" aria-label="Zoom in" onClick=${() => act((one) => one.zoomBy(STEP))}>+</button>
          <button class="small" disabled=${zoom === 1} onClick=${() => act((one) => one.fit())}>Whole picture</button>
        </span>
      </div>
    </section>
  `;
}

/** How much older the drawn picture is than the cars on the map [s]; at least since one was received. */
function behind_s(camera, drawn_t_ns) {
  const map_t_ns = live.topic?.t_ns ?? null;
  if (drawn_t_ns === null || map_t_ns === null) return camera.age_s;
  return Math.max(camera.age_s, (map_t_ns - Number(drawn_t_ns)) / 1e9);
}

/** Zoom by the wheel where the pointer is; the page must not scroll then, so it listens itself. */
function useWheel(canvas, act) {
  useEffect(() => {
    const element = canvas.current;
    const onWheel = (event) => {
      if (!event.ctrlKey && !event.metaKey && event.deltaY > 0 && element.dataset.zoom === "1.00") return;
      event.preventDefault();
      const { left, top, width, height } = element.getBoundingClientRect();
      const spot = [(event.clientX - left) / width, (event.clientY - top) / height];
      act((one) => one.zoomBy(event.deltaY < 0 ? 1.2 : 1 / 1.2, spot));
    };
    element.addEventListener("wheel", onWheel, { passive: false });
    return () => element.removeEventListener("wheel", onWheel);
  }, []);
}

function dragging(act) {
  return {
    onPointerDown: (event) => event.currentTarget.setPointerCapture(event.pointerId),
    onPointerMove: (event) => {
      if (!(event.buttons & 1)) return;
      const { clientWidth, clientHeight } = event.currentTarget;
      act((one) => one.panBy(event.movementX / clientWidth, event.movementY / clientHeight));
    },
  };
}

const KEYS = {
  "+": (one) => one.zoomBy(STEP),
  "=": (one) => one.zoomBy(STEP),
  "-": (one) => one.zoomBy(1 / STEP),
  0: (one) => one.fit(),
  ArrowLeft: (one) => one.panBy(0.1, 0),
  ArrowRight: (one) => one.panBy(-0.1, 0),
  ArrowUp: (one) => one.panBy(0, 0.1),
  ArrowDown: (one) => one.panBy(0, -0.1),
};

function onKey(event, act) {
  const change = KEYS[event.key];
  if (!change) return;
  event.preventDefault();
  act(change);
}
