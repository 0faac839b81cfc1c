/** A new car from a few figures: what they lead to is drawn while they are written. */
import { useEffect, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { placed } from "scm/shared/base.js";
import { change } from "scm/shell/api.js";
import { SeenFromAbove } from "scm/pages/cars/seen_from_above.js";

const PAUSE_MS = 300;

/** Fields that may stay empty, in what people measure: name, words, unit, how many of it make an SI unit. */
const OPTIONAL = [
  ["length_m", "Length", "cm", 100],
  ["width_m", "Width", "cm", 100],
  ["track_m", "Track, middle of a wheel to the other's", "cm", 100],
  ["wheel_radius_m", "Wheel radius", "cm", 100],
  ["steering_limit_rad", "Wheels turn to either side", "°", 180 / Math.PI],
  ["acceleration_mps2", "Acceleration from standing", "m/s²", 1],
];

export function NewCar({ folder, names, onWritten }) {
  const [form, setForm] = useState(null);
  const [preview, setPreview] = useState({});
  const [written, setWritten] = useState("");
  const [element, setElement] = useState(null);
  useEffect(() => void (element && setForm(bodyOf(element))), [element]);
  useEffect(() => {
    if (!form) return undefined;
    const abort = new AbortController();
    const wait = setTimeout(() => void look(form, names, abort.signal, setPreview), PAUSE_MS);
    return () => (clearTimeout(wait), abort.abort());
  }, [form, names.join()]);
  const submit = async (event) => {
    event.preventDefault();
    const body = bodyOf(event.target);
    const made = await change("POST", "/cars", body, () => `${body.car} is a car file of this city.`);
    if (made) (setWritten(body.car), onWritten());
  };
  return html`
    <section class="panel new-car" aria-label="New car">
      <div class="panel-head"><h2>New car</h2></div>
      <form ref=${setElement} onInput=${(event) => setForm(bodyOf(event.currentTarget))} onSubmit=${submit}>
        <p class="hint">
          Four figures make a car file; more make it surer. What you do not know is estimated from the shipped cars,
          and the file states the uncertainty of each number. <code>scm mismatch</code> finds the rest from a recording.
        </p>
        <div class="fields">
          <label>Name <input name="car" defaultValue="my_car" pattern="[a-z][a-z0-9_\\-]{0,31}" title="small letters, digits, _ and -" required /></label>
          <${Number_} name="scale" words="Scale 1:" defaultValue="10" min="1" max="100" step="1" />
          <${Number_} name="mass_kg" words="Mass with battery [kg]" defaultValue="3.2" min="0.2" max="200" />
          <${Number_} name="wheelbase_m" words="Wheelbase [cm]" defaultValue="32.4" min="5" max="200" />
          <${Number_} name="top_speed_mps" words="Top speed [m/s]" defaultValue="6" min="0.01" max="50" />
          <label>
            Motor
            <select name="motor">
              <option value="direct" title="can be pushed when it is off">direct, as RC cars</option>
              <option value="geared" title="holds the car when it is off">geared, as Nigel</option>
            </select>
          </label>
          <label>
            Driven wheels
            <select name="driven"><option>rear</option><option>front</option><option>all</option></select>
          </label>
        </div>
        <details>
          <summary>More figures</summary>
          <div class="fields">
            ${OPTIONAL.map(
              ([name, words, unit]) => html`<${Number_} key=${name} name=${name} words="${words} [${unit}]" placeholder="estimated" min="0" />`,
            )}
            <${Number_} name="tag_size_m" words="Roof tag, black edge [cm]; 0: none" defaultValue="7.62" min="0" max="100" />
          </div>
          <label class="check"><input type="checkbox" name="lidar" /> LIDAR</label>
          <label class="check"><input type="checkbox" name="camera" /> Camera</label>
        </details>
        ${preview.problem && form?.car !== written && html`<p class="form-error" role="alert">${preview.problem}</p>`}
        ${folder
          ? html`<button class="primary" disabled=${!preview.row || Boolean(preview.problem)}>Make the car file</button>`
          : html`<p class="hint">This city has no folder for car files: start it with <code>SCM_CARS=FOLDER</code>, or copy the text below.</p>`}
      </form>
      ${written && html`<${Next} car=${written} />`}
      ${preview.row && html`<${Made} row=${preview.row} />`}
    </section>
  `;
}

function Number_({ name, words, ...more }) {
  return html`<label>${words} <input name=${name} type="number" step="any" ...${more} /></label>`;
}

function Next({ car }) {
  return html`
    <p class="next" role="status">
      <strong>${car}</strong> can join now: by “Add a car” on the <a href="/map">map</a>, or by an agent of its own:${" "}
      <code>vehicle-agent join --car ${car} --name NAME --connect ADDRESS</code>, on another computer with${" "}
      <a href="/api/v1/cars/${car}.toml" download>the file</a> in a folder that <code>SCM_CARS</code> names.
    </p>
  `;
}

function Made({ row }) {
  return html`
    <${SeenFromAbove} row=${row} />
    <p class=${row.misfit ? "warn" : "good"} role="status">
      ${row.misfit ? `On this map: ${row.misfit}.` : "It can follow all lanes of this map."}
    </p>
    <details class="text"><summary>The car file</summary><pre tabindex="0">${row.text}</pre></details>
  `;
}

/** The values of a form, in SI units; empty fields are left out. */
function bodyOf(form) {
  const fields = new FormData(form);
  const body = { car: fields.get("car").trim(), motor: fields.get("motor"), driven: fields.get("driven") };
  const fill = (name, per_unit) => {
    const text = fields.get(name);
    if (text) body[name] = Number(text) / per_unit;
  };
  if (fields.get("scale")) body.scale = `1:${fields.get("scale")}`;
  for (const [name, per_unit] of [["mass_kg", 1], ["wheelbase_m", 100], ["top_speed_mps", 1], ["tag_size_m", 100]]) fill(name, per_unit);
  for (const [name, , , per_unit] of OPTIONAL) fill(name, per_unit);
  for (const name of ["lidar", "camera"]) body[name] = fields.has(name);
  return body;
}

async function look(body, names, signal, setPreview) {
  // A name that is taken is no reason to show nothing of the car.
  const exists = names.includes(body.car);
  const query = new URLSearchParams({ ...body, ...(exists && { car: "new_car" }) });
  const reply = await fetch(placed(`/api/v1/cars/preview?${query}`), { signal }).catch(() => null);
  if (signal.aborted) return;
  const answer = await reply?.json().catch(() => null);
  if (!reply?.ok) setPreview({ problem: sentence(answer) });
  else setPreview({ row: answer, problem: exists ? `There is a car file named ${body.car} already.` : "" });
}

function sentence(problem) {
  const wrong = (problem?.errors ?? []).map(({ where, expected }) => `${where}: ${expected}`);
  return wrong.join("; ") || problem?.detail || "The city cannot be reached.";
}
