/** The fields of a mismatch search, shared by the mismatch page and a recording's page. */
import { html } from "scm/shared/html.js";
import { seconds, SpanFields, WHOLE } from "scm/shared/span_fields.js";

/** Seconds that a search may take, in words; the last is the default. */
const BUDGETS = [
  [30, "half a minute"],
  [120, "two minutes"],
  [600, "ten minutes"],
  [1800, "as it needs, half an hour at most"],
];

/** A new question about a car, empty: all of them, by the car file that the recording names. */
export const question = (vehicle = "") => ({ vehicle, car: "", budget_s: BUDGETS.at(-1)[0], span: WHOLE });

/** What `POST /mismatch/jobs` gets of a question, beside the recording. */
export const searchBody = ({ vehicle, car, budget_s, span }) => ({ vehicle, car, budget_s, ...seconds(span) });

/**
 * @param value of `question`; `onChange` gets the new one
 * @param cars names of the recording's cars; null: not known, one is typed
 * @param files names of car files; `most_s` and `player` as of `SpanFields`
 */
export function SearchFields({ value, onChange, cars = null, files, most_s = null, player = null }) {
  const set = (change) => onChange({ ...value, ...change });
  const own = (name) => ({ name, value: value[name], onInput: (event) => set({ [name]: event.target.value }) });
  return html`
    <label>
      Car
      ${cars
        ? html`
            <select ...${own("vehicle")} data-first>
              <option value="">all</option>
              ${cars.map((name) => html`<option key=${name}>${name}</option>`)}
            </select>
          `
        : html`<input ...${own("vehicle")} placeholder="all" pattern="[A-Za-z0-9_\\-]*" maxlength="64" autocomplete="off" />`}
    </label>
    <label>
      Car file
      <select ...${own("car")}>
        <option value="">the recording's</option>
        ${files.map((name) => html`<option key=${name}>${name}</option>`)}
      </select>
    </label>
    <${SpanFields} most_s=${most_s} player=${player} span=${value.span} onChange=${(span) => set({ span })} />
    <label class="long">
      Time for it
      <select name="budget_s" value=${value.budget_s} onInput=${(event) => set({ budget_s: Number(event.target.value) })}>
        ${BUDGETS.map(([s, words]) => html`<option key=${s} value=${s}>${words}</option>`)}
      </select>
    </label>
  `;
}
