/** Step 2: where the camera hangs, by the tags on the floor that it sees now; before and after. */
import { useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { fixed } from "scm/shared/format.js";
import { savedBy, useUnfinished } from "scm/pages/eye/unfinished.js";
import { readBody } from "scm/shared/fetched.js";
import { finished } from "scm/shared/operation.js";
import { filledIn, freeName, Progress, useStored } from "scm/pages/eye/progress.js";
import { change, notify } from "scm/shell/api.js";

const VAGUE_M = 0.01;
const TURNS = ["yaw_rad", "tilt_x_rad", "tilt_y_rad"];
const WORDS = { x_m: "x", y_m: "y", z_m: "height", yaw_rad: "yaw", tilt_x_rad: "tilt about x", tilt_y_rad: "tilt about y" };

export function PlaceStep({ camera, saved, lenses, done, put }) {
  const [lens, setLens] = useState("");
  const [tags, setTags] = useStored(`floor-tags ${camera.camera}`, []);
  const [row, setRow] = useState(null);
  const [found, setFound] = useState(null);
  const step = useRef(null);
  const busy = row !== null && ["waiting", "running"].includes(row.state);
  const name = freeName(`${camera.camera}-place`, saved);
  const seen = camera.known.filter((one) => one.what === "map" && one.seen_s < 2);
  const follow = async (operation) => {
    const called = savedBy(await finished(operation, setRow));
    if (!called) return;
    const report = await readBody(`/eye/calibrations/${called}/report`).catch(() => null);
    setFound(report && { ...report, name: called });
    notify("info", `The place is saved as ${called}.`);
    done();
  };
  useUnfinished([`place of ${camera.camera}`], follow);
  const run = async () => {
    if (!filledIn(step.current)) return;
    const body = { lens: lens || null, tags: tags.map(inNumbers), save_as: name };
    const operation = await change("POST", `/eye/cameras/${camera.camera}/place`, body);
    if (operation) await follow(operation);
  };
  return html`
    <section ref=${step} class="panel eye-place" aria-label="Place">
      <div class="panel-head">
        <h2><b class="step">2</b> Place <small>by tags on the floor</small></h2>
        <span class="facts">${seen.length ? `sees map tag ${seen.map((one) => one.tag_id).join(", ")}` : "sees no map tag"}</span>
      </div>
      <p class="note">
        The map's own tag alone determines height and tilt poorly: lay more near the corners of the frame, measured to a
        millimetre, and name them here.
      </p>
      <label class="inline">Lens
        <select name="lens" value=${lens} onChange=${(event) => setLens(event.currentTarget.value)}>
          <option value="">as on the map</option>
          ${lenses.map((one) => html`<option key=${one.name} value=${one.name}>${one.name}</option>`)}
        </select>
      </label>
      <${FloorTags} tags=${tags} set=${setTags} />
      <div class="row">
        <button class="primary" disabled=${busy || (!seen.length && !tags.length)} onClick=${run}>Find the place</button>
        <small>${`will be saved as ${name}`}</small>
      </div>
      <${Progress} row=${row} cancel=${() => change("DELETE", `/operations/${row.id}`)} />
      ${found && html`<${Found} found=${found} put=${put} />`}
    </section>
  `;
}

const EMPTY = { id: 100, x_m: 0, y_m: 0, yaw_rad: 0, size_m: 0.12 };
const COLUMNS = { id: "Id", x_m: "x [m]", y_m: "y [m]", yaw_rad: "yaw [rad]", size_m: "edge [m]" };

/** A tag as the server takes it; fields hold what was typed. */
function inNumbers(tag) {
  return Object.fromEntries(Object.entries(tag).map(([field, typed]) => [field, Number(typed)]));
}

function FloorTags({ tags, set }) {
  const edit = (i, field, value) => set(tags.map((one, j) => (i === j ? { ...one, [field]: value } : one)));
  return html`
    ${tags.length > 0 &&
    html`
      <table class="floor-tags">
        <thead><tr>${Object.values(COLUMNS).map((title) => html`<th key=${title} scope="col">${title}</th>`)}<th></th></tr></thead>
        <tbody>
          ${tags.map((tag, i) => html`
            <tr key=${i}>
              ${Object.entries(COLUMNS).map(([field, title]) => html`
                <td key=${field}>
                  <input
                    type="number"
                    step=${field === "id" ? 1 : "any"}
                    required
                    aria-label="Tag ${i + 1}: ${title}"
                    value=${tag[field]}
                    onInput=${(event) => edit(i, field, event.currentTarget.value)}
                  />
                </td>
              `)}
              <td><button class="plain" aria-label="Remove tag ${i + 1}" onClick=${() => set(tags.filter((_, j) => j !== i))}>×</button></td>
            </tr>
          `)}
        </tbody>
      </table>
    `}
    <button class="small start" onClick=${() => set([...tags, { ...EMPTY, id: EMPTY.id + tags.length }])}>Add a floor tag</button>
  `;
}

function Found({ found, put }) {
  const vague_m = Math.max(...found.deviations.slice(0, 3));
  return html`
    <div class="result">
      <h3>${found.is_sure ? "Found" : "Found, but not for sure"}</h3>
      ${!found.is_sure && html`<p class="warn">Two places would show these tags alike: lay a second tag far from the first.</p>`}
      ${vague_m > VAGUE_M && html`<p class="warn">${`Known to ${fixed(1000 * vague_m, 0)} mm only: the Eye would not trust its poses. Lay more tags, far apart.`}</p>`}
      <table>
        <thead><tr><th scope="col">Camera</th><th scope="col" class="number">on the map</th><th scope="col" class="number">found</th><th scope="col" class="number">±</th></tr></thead>
        <tbody>
          ${found.names.map((name, i) => html`
            <tr key=${name}>
              <th scope="row">${WORDS[name]}</th>
              <td class="number">${shown(name, found.before[name])}</td>
              <td class="number">${shown(name, found.after[name])}</td>
              <td class="number">${shown(name, found.deviations[i])}</td>
            </tr>
          `)}
        </tbody>
      </table>
      <table>
        <thead><tr><th scope="col">Floor tag</th><th scope="col" class="number">before</th><th scope="col" class="number">after</th><th scope="col" class="number">on the floor</th></tr></thead>
        <tbody>
          ${found.tags.map((tag) => html`
            <tr key=${tag.tag_id}>
              <th scope="row">${tag.tag_id}${tag.left_out && html` <span class="warn">left out</span>`}</th>
              <td class="number">${fixed(tag.before_px, 2, " px")}</td>
              <td class="number">${fixed(tag.after_px, 2, " px")}</td>
              <td class="number">${`${fixed(tag.before_mm, 1)} → ${fixed(tag.after_mm, 1)} mm`}</td>
            </tr>
          `)}
        </tbody>
      </table>
      <button class=${vague_m > VAGUE_M ? "" : "primary"} onClick=${() => put(found.name)}>Put it in force…</button>
    </div>
  `;
}

function shown(name, value) {
  if (value === null) return "—";
  return TURNS.includes(name) ? fixed((value * 180) / Math.PI, 3, "°") : fixed(1000 * value, 1, " mm");
}
