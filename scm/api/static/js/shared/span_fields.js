/** From when to when of a recording: two fields in seconds, where it is played each with a button for its moment. */
import { useLayoutEffect, useRef } from "preact/hooks";
import { html } from "scm/shared/html.js";

/** All of it. */
export const WHOLE = { start: "", stop: "" };

/** @returns {{from_s, to_s}} the span in seconds; null: from the begin, to the end. */
export function seconds({ start, stop }) {
  return { from_s: start === "" ? null : Number(start), to_s: stop === "" ? null : Number(stop) };
}

/**
 * The browser reports what is wrong with them before their form is sent.
 * @param most_s length of the recording, null: not known here
 * @param player what plays it, null: nothing does
 */
export function SpanFields({ most_s = null, player = null, span, onChange }) {
  const stop = useRef(null);
  const { from_s, to_s } = seconds(span);
  useLayoutEffect(() => {
    const backwards = from_s !== null && to_s !== null && to_s <= from_s;
    stop.current.setCustomValidity(backwards ? `It has to end after ${from_s} s, where it begins.` : "");
  }, [from_s, to_s]);
  const field = (end, title, empty, ref) => html`
    <label>
      ${title}
      <span class="with-button">
        <input
          ref=${ref}
          name=${end}
          type="number"
          min="0"
          max=${most_s === null ? null : Math.ceil(most_s)}
          step="any"
          placeholder=${empty}
          value=${span[end]}
          onInput=${(event) => onChange({ ...span, [end]: event.target.value })}
        />
        ${player &&
        html`
          <button
            type="button"
            onClick=${() => onChange({ ...span, [end]: player.t_s.toFixed(1) })}
            aria-label="${title}: the moment that is shown, ${player.t_s.toFixed(1)} s"
            title="The moment that is shown"
          >
            ${player.t_s.toFixed(1)} s
          </button>
        `}
      </span>
    </label>
  `;
  return html`${field("start", "From [s]", "start")}${field("stop", "To [s]", "end", stop)}`;
}
