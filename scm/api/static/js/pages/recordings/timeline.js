/** The slider with its event marks, and the buttons that play. */
import { useEffect } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { SPEEDS } from "scm/pages/recordings/player.js";
import { minutes, spoken, timeOfDay } from "scm/pages/recordings/words.js";

const STEP_S = 0.1;
const SMALL_S = 1;
const LARGE_S = 10;

export function Timeline({ player, events, disturbances, begin_ns }) {
  useEffect(() => {
    const onKey = (event) => press(event, player, events);
    window.addEventListener("keydown", onKey);
    return () => window.removeEventListener("keydown", onKey);
  }, [player, events]);
  const length_s = player.length.value;
  const at_s = player.at.value;
  return html`
    <div class="transport">
      <div class="slide">
        <div class="marks" aria-hidden="true">
          ${player.first_s > 1 && html`<i class="before" style=${{ width: share(player.first_s, length_s) }}></i>`}
          ${disturbances.map(
            ({ start_s, end_s, text }) => html`
              <i
                key=${`${start_s} ${text}`}
                class="void"
                title=${text}
                style=${{ left: share(start_s, length_s), width: share(end_s - start_s, length_s) }}
              ></i>
            `,
          )}
          ${events.map(
            (event) => html`
              <i
                key=${event.number}
                data-severity=${event.severity}
                style=${{ left: share(event.t_s, length_s) }}
              ></i>
            `,
          )}
        </div>
        <input
          type="range"
          min="0"
          max=${length_s}
          step=${STEP_S}
          value=${at_s}
          aria-label="Moment of the recording"
          aria-valuetext=${`${spoken(at_s)} of ${spoken(length_s)}`}
          onInput=${(event) => player.seek(Number(event.target.value))}
        />
      </div>
      <div class="buttons">
        <${Button} text="|◂" title="Event before (P)" act=${() => jump(player, events, -1)} />
        <${Button} text="◂" title="One frame back (,)" act=${() => player.step(-1)} />
        <button
          class="play primary"
          aria-pressed=${player.playing.value}
          title="Play or pause (space)"
          onClick=${() => player.play()}
        >
          ${player.playing.value ? "Pause" : "Play"}
        </button>
        <${Button} text="▸" title="One frame on (.)" act=${() => player.step(1)} />
        <${Button} text="▸|" title="Next event (N)" act=${() => jump(player, events, 1)} />
        <select
          aria-label="Speed"
          title="Speed (+ and −)"
          value=${player.speed.value}
          onChange=${(event) => (player.speed.value = Number(event.target.value))}
        >
          ${SPEEDS.map((speed) => html`<option value=${speed}>${speed}×</option>`)}
        </select>
        <button
          class="loop"
          aria-pressed=${player.loop.value}
          title="Begin again at the end (L)"
          onClick=${() => (player.loop.value = !player.loop.value)}
        >
          Loop
        </button>
        <p class="at">
          <b>${minutes(at_s, true)}</b> <small>of ${minutes(length_s)}</small>
          <small class="then">${timeOfDay(begin_ns + at_s * 1e9)}</small>
        </p>
      </div>
    </div>
  `;
}

function Button({ text, title, act }) {
  return html`<button title=${title} aria-label=${title} onClick=${act}>${text}</button>`;
}

function share(t_s, length_s) {
  return `${length_s > 0 ? Math.min(100, (100 * t_s) / length_s) : 0}%`;
}

/** Go to the next event, or to the one before. */
export function jump(player, events, direction) {
  const at_s = player.t_s;
  const found =
    direction > 0
      ? events.find((event) => event.t_s > at_s + 0.05)
      : events.findLast((event) => event.t_s < at_s - 0.5);
  player.seek(found ? found.t_s : direction > 0 ? player.length.value : player.first_s);
}

/** Keys of the whole page, except where somebody writes. */
function press(event, player, events) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const { tagName, type } = event.target;
  const writes = tagName === "TEXTAREA" || tagName === "SELECT" || (tagName === "INPUT" && type !== "range");
  if (writes || document.querySelector("dialog[open]")) return;
  const by_s = event.shiftKey ? LARGE_S : SMALL_S;
  const acts = {
    ArrowLeft: () => player.seek(player.t_s - by_s),
    ArrowRight: () => player.seek(player.t_s + by_s),
    Home: () => player.seek(player.first_s),
    End: () => player.seek(player.length.value),
    ",": () => player.step(-1),
    ".": () => player.step(1),
    "+": () => player.faster(1),
    "-": () => player.faster(-1),
    l: () => (player.loop.value = !player.loop.value),
    n: () => jump(player, events, 1),
    p: () => jump(player, events, -1),
  };
  if (tagName !== "BUTTON" && tagName !== "A") acts[" "] = () => player.play();
  const act = acts[event.key];
  if (!act) return;
  event.preventDefault();
  act();
}
