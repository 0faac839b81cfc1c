/** Begin a mismatch job: does this car drive as its file says? */
import { useEffect, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";
import { change } from "scm/shell/api.js";
import { go } from "scm/shell/router.js";
import { read } from "scm/pages/recordings/reading.js";
import { seconds, SpanFields, WHOLE } from "scm/pages/recordings/span_fields.js";
import { minutes } from "scm/pages/recordings/words.js";

const BUDGETS_S = [60, 120, 300, 600, 1800];

export function MismatchDialog({ recording, cars, player, chosen, onClose }) {
  const first = cars.find((car) => car.vehicle === chosen) ?? cars[0];
  const [vehicle, setVehicle] = useState(first?.vehicle ?? "");
  const [car, setCar] = useState(first?.car ?? "nigel");
  const [span, setSpan] = useState(WHOLE);
  const [files, setFiles] = useState([]);
  useEffect(() => void read("/mismatch/offers").then(({ body }) => setFiles(body.cars), () => {}), []);
  const choose = (name) => {
    setVehicle(name);
    setCar(cars.find((one) => one.vehicle === name)?.car ?? car);
  };
  const submit = async (event) => {
    event.preventDefault();
    const body = {
      recording: recording.name,
      vehicle,
      car,
      budget_s: Number(event.target.elements.budget.value),
      ...seconds(span),
    };
    const done = () => `The search for ${vehicle} has begun.`;
    if (await change("POST", "/mismatch/jobs", body, done)) {
      onClose();
      go("/mismatch");
    }
  };
  return html`
    <${Dialog} title="Start a mismatch job" onClose=${onClose}>
      <p class="hint">Drives the car's file with the recorded commands, and searches for what the two differ in.</p>
      ${!cars.length && html`<p class="trouble">This recording tells of no car.</p>`}
      <form class="fields two-by-two" onSubmit=${submit}>
        <label>
          Car
          <select name="vehicle" data-first value=${vehicle} onChange=${(event) => choose(event.target.value)}>
            ${cars.map((one) => html`<option value=${one.vehicle}>${one.vehicle} (${one.kind})</option>`)}
          </select>
        </label>
        <label>
          Car file
          <select name="car" value=${car} onChange=${(event) => setCar(event.target.value)}>
            ${[...new Set([...files, car])].toSorted().map((name) => html`<option key=${name}>${name}</option>`)}
          </select>
        </label>
        <${SpanFields} recording=${recording} player=${player} span=${span} onChange=${setSpan} />
        <label>
          Search for at most
          <select name="budget">
            ${BUDGETS_S.map((s) => html`<option value=${s} selected=${s === BUDGETS_S.at(-1)}>${minutes(s)} min</option>`)}
          </select>
        </label>
        <div class="actions">
          <button type="button" onClick=${onClose}>Cancel</button>
          <button class="primary" disabled=${!cars.length}>Start</button>
        </div>
      </form>
    <//>
  `;
}
