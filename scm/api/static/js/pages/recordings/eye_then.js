/** What cameras saw at the moment that is shown: the newest picture that was recorded by then. */
import { useEffect, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { minutes } from "scm/pages/recordings/words.js";
import { placed } from "scm/shared/base.js";

const OLD_S = 2; // one a second is recorded; a busy machine makes fewer

/** @param {{ eye: string[], own: {vehicle, camera}[], chosen: string | null }} own: the cars' cameras */
export function EyeThen({ player, eye, own, chosen }) {
  const cameras = [...eye.map((camera) => ({ vehicle: "", camera })), ...own];
  const [shown, setShown] = useState(0);
  useEffect(() => {
    const at = cameras.findIndex((one) => one.vehicle === chosen);
    if (at >= 0) setShown(at);
  }, [chosen]);
  const one = cameras[shown];
  return html`
    <section class="panel eye-then" aria-label="Pictures at this moment">
      <div class="panel-head">
        <h2>${own.length ? "Cameras" : "Eye"}</h2>
        ${cameras.length > 1 &&
        html`
          <select aria-label="Camera" value=${shown} onChange=${(event) => setShown(Number(event.target.value))}>
            ${cameras.map((each, number) => html`<option value=${number}>${named(each)}</option>`)}
          </select>
        `}
      </div>
      <${Picture} key=${named(one)} player=${player} one=${one} />
    </section>
  `;
}

function named({ vehicle, camera }) {
  return vehicle ? `${vehicle}, ${camera}` : camera;
}

function address(recording, { vehicle, camera }) {
  const of = vehicle ? `vehicles/${encodeURIComponent(vehicle)}/camera` : "eye";
  return placed(`/api/v1/recordings/${encodeURIComponent(recording)}/${of}/${encodeURIComponent(camera)}.jpg`);
}

function Picture({ player, one }) {
  const [requested_s, setRequested] = useState(null);
  const [came, setCame] = useState({ t_s: null, good: false });
  const [large, setLarge] = useState(false);
  const at_s = player.at.value;
  const wanted = player.came.value >= 0 ? player.pictureOf(one) : null;
  useEffect(() => {
    // One at a time: at eight times the pace the one after next would else stop each on its way.
    if (wanted && wanted.t_s !== requested_s && came.t_s === requested_s) setRequested(wanted.t_s);
  });
  if (!wanted && player.has(player.t_s)) return html`<p class="empty">No picture was recorded by then.</p>`;
  const age_s = Math.max(0, at_s - came.t_s);
  return html`
    <button
      class="seen ${large ? "large" : ""}"
      data-at=${came.good ? came.t_s : null}
      data-old=${age_s > OLD_S}
      aria-pressed=${large}
      title=${large ? "Smaller" : "Larger"}
      onClick=${() => setLarge(!large)}
      onKeyDown=${(event) => event.key === "Escape" && setLarge(false)}
    >
      ${requested_s !== null &&
      html`<img
        src="${address(player.name, one)}?t_s=${requested_s}"
        alt="What camera ${named(one)} saw, not live"
        onLoad=${() => setCame({ t_s: requested_s, good: true })}
        onError=${() => setCame({ t_s: requested_s, good: false })}
      />`}
      <span class="stamp" aria-hidden="true">Not live</span>
    </button>
    <p class="hint">${captionOf(came, age_s)}</p>
  `;
}

function captionOf(came, age_s) {
  if (came.t_s === null) return "Reading the picture…";
  if (!came.good) return `The picture of ${minutes(came.t_s, true)} cannot be shown.`;
  const age = age_s > OLD_S ? `the newest by then, ${age_s.toFixed(0)} s old` : `${age_s.toFixed(1)} s before`;
  return `Recorded at ${minutes(came.t_s, true)}, ${age}`;
}
