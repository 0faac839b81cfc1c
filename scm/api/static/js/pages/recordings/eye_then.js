/** What the Eye saw at the moment that is shown: the newest picture that was recorded by then. */
import { useEffect, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { minutes } from "scm/pages/recordings/words.js";

const OLD_S = 2; // one a second is recorded; a busy machine makes fewer

export function EyeThen({ player, cameras }) {
  const [camera, setCamera] = useState(cameras[0]);
  return html`
    <section class="panel eye-then" aria-label="Eye at this moment">
      <div class="panel-head">
        <h2>Eye</h2>
        ${cameras.length > 1 &&
        html`
          <select aria-label="Overhead camera" value=${camera} onChange=${(event) => setCamera(event.target.value)}>
            ${cameras.map((name) => html`<option value=${name}>${name}</option>`)}
          </select>
        `}
      </div>
      <${Picture} key=${camera} player=${player} camera=${camera} />
    </section>
  `;
}

function Picture({ player, camera }) {
  const [asked_s, setAsked] = useState(null);
  const [came, setCame] = useState({ t_s: null, good: false });
  const [large, setLarge] = useState(false);
  const at_s = player.at.value;
  const wanted = player.came.value >= 0 ? player.pictureOf(camera) : null;
  useEffect(() => {
    // One at a time: at eight times the pace the one after next would else stop each on its way.
    if (wanted && wanted.t_s !== asked_s && came.t_s === asked_s) setAsked(wanted.t_s);
  });
  if (!wanted && player.has(player.t_s)) return html`<p class="empty">No picture was recorded by then.</p>`;
  const source = `/api/v1/recordings/${encodeURIComponent(player.name)}/eye/${encodeURIComponent(camera)}.jpg`;
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
      ${asked_s !== null &&
      html`<img
        src="${source}?t_s=${asked_s}"
        alt="What camera ${camera} saw, not live"
        onLoad=${() => setCame({ t_s: asked_s, good: true })}
        onError=${() => setCame({ t_s: asked_s, good: false })}
      />`}
      <span class="stamp" aria-hidden="true">Not live</span>
    </button>
    <p class="hint">${told(came, age_s)}</p>
  `;
}

function told(came, age_s) {
  if (came.t_s === null) return "Reading the picture…";
  if (!came.good) return `The picture of ${minutes(came.t_s, true)} cannot be shown.`;
  const age = age_s > OLD_S ? `the newest by then, ${age_s.toFixed(0)} s old` : `${age_s.toFixed(1)} s before`;
  return `Recorded at ${minutes(came.t_s, true)}, ${age}`;
}
