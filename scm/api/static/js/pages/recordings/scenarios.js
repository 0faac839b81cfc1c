/** Scenarios: scripts that drive the fleet. Read or edit one, run it, see its output, stop it. */
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";
import { clock } from "scm/shared/format.js";
import { Sure } from "scm/shared/sure.js";
import { change } from "scm/shell/api.js";
import { go, route } from "scm/shell/router.js";
import { Tabs } from "scm/pages/recordings/tabs.js";
import { read, useFetched } from "scm/shared/fetched.js";
import { BASE } from "scm/shared/base.js";

const LOOK_MS = 1000;
const LIVE = "--live --connect {connect}";
const NEW = `"""Two cars lap the map; their times are printed."""

import os

from scm.fleet import open_city

with open_city("driving_school", connect=os.environ["SCM_CONNECT"]) as city:
    cars = [city.spawn("nigel") for _ in range(2)]
    trips = [car.drive("east_loop", "west_loop") for car in cars]
    city.wait(trips, timeout_s=300.0)
    for trip in trips:
        print(f"{trip.vehicle}: {trip.length_m:.2f} m in {trip.travel_time_s:.1f} s")
`;

export function Scenarios() {
  const { query } = route.value;
  const list = useFetched("/scenarios");
  const work = useFetched("/operations?limit=200", LOOK_MS);
  const runs = (work.body?.items ?? []).filter((row) => row.kind === "scenario");
  const run = runs.find((row) => row.id === query.run) ?? null;
  const name = query.script ?? run?.what ?? list.body?.items[0]?.name ?? "";
  return html`
    <${Tabs} here="scenarios" />
    <div class="workshop">
      <${List} list=${list} here=${name} />
      <${Script} key=${name} name=${name} again=${list.again} seen=${work.again} />
      <${Runs} runs=${runs} chosen=${run ?? runs[0] ?? null} error=${work.error} />
    </div>
  `;
}

function List({ list, here }) {
  const [naming, setNaming] = useState(false);
  return html`
    <section class="panel scripts" aria-label="Scripts">
      <div class="panel-head">
        <h2>Scripts <small>${list.body?.items.length ?? ""}</small></h2>
        <button class="small" onClick=${() => setNaming(true)}>New</button>
      </div>
      ${list.error && html`<p class="form-error" role="alert">${list.error}</p>`}
      <ul>
        ${list.body?.items.map(
          (row) => html`
            <li key=${row.name}>
              <a href="/recordings/scenarios?script=${row.name}" aria-current=${row.name === here ? "page" : null}>
                <b>${row.name}</b> ${row.shipped && html`<small>shipped</small>`}
                <span>${row.about}</span>
              </a>
            </li>
          `,
        )}
      </ul>
      ${list.body && !list.body.items.length && html`<p class="empty">No script is stored here yet.</p>`}
      ${naming && html`<${NameDialog} title="A new script" text=${NEW} onClose=${() => setNaming(false)} onSaved=${list.again} />`}
    </section>
  `;
}

function NameDialog({ title, text, onClose, onSaved }) {
  const submit = async (event) => {
    event.preventDefault();
    const name = event.target.elements.script.value;
    const done = () => `${name} is saved.`;
    if (await change("PUT", `/scenarios/${name}`, { text }, done, { "If-None-Match": "*" })) {
      onSaved();
      onClose();
      go(`/recordings/scenarios?script=${name}`);
    }
  };
  return html`
    <${Dialog} title=${title} onClose=${onClose}>
      <form class="fields" onSubmit=${submit}>
        <label>
          Name
          <input name="script" required pattern="[A-Za-z][A-Za-z0-9_\\-]*" maxlength="60" placeholder="rush_hour" data-first />
        </label>
        <div class="actions">
          <button type="button" onClick=${onClose}>Cancel</button>
          <button class="primary">Keep</button>
        </div>
      </form>
    <//>
  `;
}

/** Arguments that lead a script to this city, where it takes such: without them it looks at the usual port. */
function offered(text) {
  if (text.includes('"--live"')) return LIVE;
  return text.includes('"--url"') ? `--url ${location.origin}${BASE}` : "";
}

function Script({ name, again, seen }) {
  const [known, setKnown] = useState(null);
  const [error, setError] = useState("");
  const [text, setText] = useState("");
  const [naming, setNaming] = useState(false);
  const [sure, setSure] = useState(false);
  const show = ({ body, etag }) => {
    setKnown({ ...body, etag });
    setText(body.text);
  };
  useEffect(() => {
    if (name) read(`/scenarios/${name}`).then(show, (failed) => setError(failed.message));
  }, [name]);
  if (error) return html`<section class="panel script"><p class="form-error" role="alert">${error}</p></section>`;
  if (!known) return html`<section class="panel script"><p class="empty">${name ? "Reading the script…" : "Write a script: New."}</p></section>`;
  const edited = text !== known.text;
  const save = async () => {
    const done = () => `${name} is saved.`;
    if (!(await change("PUT", `/scenarios/${name}`, { text }, done, { "If-Match": known.etag }))) return;
    show(await read(`/scenarios/${name}`));
    again();
  };
  const remove = async () => {
    const gone = () => `${name} is deleted.`;
    if (!(await change("DELETE", `/scenarios/${name}`, undefined, gone, { "If-Match": known.etag }))) return;
    again();
    go("/recordings/scenarios");
  };
  return html`
    <section class="panel script" aria-label="Script">
      <div class="panel-head">
        <h2>${name}.py ${known.shipped && html`<small>came with the program</small>`}</h2>
        <div class="tools">
          ${!known.shipped && html`<button class="small" onClick=${() => setSure(true)}>Delete</button>`}
          <button class="small" onClick=${() => setNaming(true)}>Save as…</button>
          ${!known.shipped && html`<button class="small primary" disabled=${!edited} onClick=${save}>Save</button>`}
        </div>
      </div>
      <textarea
        class="code"
        aria-label="Text of the script"
        spellcheck=${false}
        wrap="off"
        value=${text}
        onInput=${(event) => setText(event.target.value)}
      ></textarea>
      <${RunForm} name=${name} edited=${edited} text=${known.text} seen=${seen} />
      ${sure &&
      html`
        <${Sure} title="Delete this script?" yes="Delete it" act=${remove} onClose=${() => setSure(false)}>
          ${`${name}.py is deleted from the disk for everybody. There is no way back.`}
        <//>
      `}
      ${naming && html`<${NameDialog} title="Save as" text=${text} onClose=${() => setNaming(false)} onSaved=${again} />`}
    </section>
  `;
}

function RunForm({ name, edited, text, seen }) {
  const submit = async (event) => {
    event.preventDefault();
    const given = event.target.elements.given.value.split(/\s+/).filter(Boolean);
    const row = await change("POST", `/scenarios/${name}/runs`, { arguments: given }, () => `${name} runs.`);
    if (row) {
      seen();
      go(`/recordings/scenarios?script=${name}&run=${row.id}`);
    }
  };
  return html`
    <form class="run" onSubmit=${submit}>
      <label>Arguments <input name="given" maxlength="400" defaultValue=${offered(text)} placeholder="none" /></label>
      <button class="primary" disabled=${edited}>Run</button>
      <small>${edited ? "Save it first: what is saved is run." : "{connect} becomes the address of this city's router."}</small>
    </form>
  `;
}

function Runs({ runs, chosen, error }) {
  return html`
    <section class="panel runs" aria-label="Runs">
      <div class="panel-head"><h2>Runs <small>${runs.length || ""}</small></h2></div>
      ${error && html`<p class="form-error" role="alert">${error}</p>`}
      ${!runs.length && html`<p class="empty">Nothing was run since the server began. What a script prints is shown here.</p>`}
      <ul>
        ${runs.slice(0, 8).map(
          (row) => html`
            <li key=${row.id} data-run=${row.id} data-state=${row.state}>
              <a
                href="/recordings/scenarios?script=${row.what}&run=${row.id}"
                aria-current=${row.id === chosen?.id ? "true" : null}
              >
                <b>${row.what}</b> <span class="state" data-state=${row.state}>${row.state}</span>
                <small>${clock(row.asked_ns)}</small>
              </a>
              ${["waiting", "running"].includes(row.state) &&
              html`<button class="small" onClick=${() => change("DELETE", `/operations/${row.id}`, undefined, () => `${row.what} is being stopped.`)}>Stop</button>`}
            </li>
          `,
        )}
      </ul>
      ${chosen && html`<${Log} key=${chosen.id} run=${chosen} />`}
    </section>
  `;
}

/** What a run prints; it follows the end while somebody is there. */
function Log({ run }) {
  const [lines, setLines] = useState([]);
  const [error, setError] = useState("");
  const box = useRef(null);
  const over = ["done", "failed", "cancelled"].includes(run.state);
  useEffect(() => {
    let gone = false;
    let timer = null;
    let next = 0;
    let mine = [];
    const look = async () => {
      const found = await read(`/scenarios/runs/${run.id}/lines?after=${next}`).catch((failed) => failed);
      if (gone) return;
      setError(found instanceof Error ? found.message : "");
      if (!(found instanceof Error)) {
        mine = [...mine, ...found.body.lines].slice(-2000);
        next = found.body.first + found.body.lines.length;
        setLines(mine);
      }
      if (!over) timer = setTimeout(look, LOOK_MS);
    };
    look();
    return () => {
      gone = true;
      clearTimeout(timer);
    };
  }, [run.id, over]);
  useEffect(() => {
    if (box.current) box.current.scrollTop = box.current.scrollHeight;
  }, [lines]);
  return html`
    ${run.error && html`<p class="form-error">${run.error}</p>`}
    ${error && html`<p class="form-error">${error}</p>`}
    <pre ref=${box} tabindex="0" role="log" aria-label="What ${run.what} prints">${lines.join("\n") || "No output yet."}</pre>
  `;
}
