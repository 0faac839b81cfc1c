/** Put a car on the map: of which file, under which name. It drives at once where there are lanes. */
import { signal } from "@preact/signals";
import { useEffect, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";
import { selected } from "scm/shared/selection.js";
import { change } from "scm/shell/api.js";
import { city } from "scm/shell/store.js";
import { placed } from "scm/shared/base.js";

const isOpen = signal(false);

export function AddCar() {
  return html`
    <button class="small" onClick=${() => (isOpen.value = true)}>Add a car</button>
    ${isOpen.value && html`<${Question} />`}
  `;
}

function Question() {
  const close = () => (isOpen.value = false);
  const submit = (event) => {
    event.preventDefault();
    const { car, vehicle } = event.target.elements;
    close();
    add({ car: car.value, vehicle: vehicle.value.trim() });
  };
  const [files, setFiles] = useState([{ car: "nigel", misfit: "" }]);
  const [chosen, setChosen] = useState("nigel");
  useEffect(() => void usable().then(setFiles, () => {}), []);
  const misfit = files.find(({ car }) => car === chosen)?.misfit;
  return html`
    <${Dialog} title="Add a car" onClose=${close}>
      <p>The world puts it on a free place${city.value?.lanes.length ? " and lets it drive" : ""}.</p>
      <form class="add-car" onSubmit=${submit}>
        <label>
          Kind of car
          <select name="car" value=${chosen} onChange=${(event) => setChosen(event.target.value)}>
            ${files.map(({ car }) => html`<option key=${car}>${car}</option>`)}
          </select>
        </label>
        ${misfit && html`<p class="form-error" role="status">On this map: ${misfit}.</p>`}
        <p class="hint">Another one? <a href="/cars">Make a car file</a> from a few figures.</p>
        <label>
          Name
          <input name="vehicle" pattern="[a-z0-9_\\-]{1,32}" placeholder="the next free one" />
        </label>
        <div class="actions">
          <button type="button" onClick=${close}>Cancel</button>
          <button class="primary" data-first>Add it</button>
        </div>
      </form>
    <//>
  `;
}

/** Car files of this city that can be used. */
async function usable() {
  const reply = await fetch(placed("/api/v1/cars"));
  const { cars } = await reply.json();
  return cars.filter(({ problem }) => !problem);
}

async function add(body) {
  const reply = await change("POST", "/vehicles", body, ({ vehicle }) => `${vehicle} is on the map.`);
  if (!reply) return;
  selected.value = reply.vehicle;
  if (city.value?.lanes.length) await change("POST", `/vehicles/${reply.vehicle}/route`, {});
}
