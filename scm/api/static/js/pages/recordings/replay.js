/** One recording again: the map at a moment, the slider, who was there, what happened, and what to do with it. */
import { signal } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { modeOf, stuckBy } from "scm/shared/condition.js";
import { coded } from "scm/shared/coded.js";
import { html } from "scm/shared/html.js";
import { fixed } from "scm/shared/format.js";
import { EyeThen } from "scm/pages/recordings/eye_then.js";
import { MismatchDialog } from "scm/pages/recordings/mismatch_dialog.js";
import { DeleteDialog, NotesDialog } from "scm/pages/recordings/notes_dialog.js";
import { Player } from "scm/pages/recordings/player.js";
import { read, useFetched } from "scm/shared/fetched.js";
import { ReplayMap } from "scm/pages/recordings/replay_map.js";
import { DownloadDialog } from "scm/pages/recordings/download_dialog.js";
import { Timeline } from "scm/pages/recordings/timeline.js";
import { minutes, moment, size } from "scm/pages/recordings/words.js";
import { route } from "scm/shell/router.js";
import { prose } from "scm/shell/prose.js";
import { windowTitle } from "scm/shell/store.js";

const EVENTS = 500;
const NOTHING = { disturbances: [], void: [] };

/** The open dialog: `notes`, `delete`, `take`, `mismatch` or null. */
const openDialog = signal(null);

export function Replay({ name }) {
  const [loaded, setLoaded] = useState({ error: "" });
  const [changed, setChanged] = useState(0);
  useEffect(() => {
    let player = null;
    let over = false;
    openDialog.value = null;
    const at_s = Number.parseFloat(route.value.query.t);
    load(name).then(
      (found) => {
        if (over) return;
        player = new Player(name, found.summary, Number.isFinite(at_s) ? at_s : null);
        setLoaded({ ...found, player, error: "" });
      },
      (error) => over || setLoaded({ error: error.message }),
    );
    return () => {
      over = true;
      player?.end();
    };
  }, [name]);
  useEffect(() => {
    if (!changed) return;
    read(address(name)).then(({ body }) =>
      setLoaded((was) => ({ ...was, summary: { ...was.summary, recording: body } })),
    );
  }, [changed]);
  useTitle(loaded.summary?.recording.title || name);
  if (loaded.error) return html`<${Unreadable} name=${name} why=${loaded.error} />`;
  if (!loaded.player) return html`<p class="empty">Reading ${name}…</p>`;
  return html`<${Played} ...${loaded} onChanged=${() => setChanged(changed + 1)} />`;
}

/** The window's title shows that this is not the live city. */
function useTitle(title) {
  useEffect(() => {
    windowTitle.value = `NOT LIVE · ${title}`;
    return () => (windowTitle.value = "");
  }, [title]);
}

function address(name) {
  return `/recordings/${encodeURIComponent(name)}`;
}

async function load(name) {
  const [summary, events] = await Promise.all([
    read(`${address(name)}/summary`),
    read(`${address(name)}/events?limit=${EVENTS}`),
  ]);
  return { summary: summary.body, events: events.body.items, more: events.body.next !== null };
}

function Unreadable({ name, why }) {
  const recording = useFetched(address(name)).body; // null where there is none of that name
  return html`
    <section class="panel" role="alert">
      <h2>${name} cannot be shown</h2>
      <p>${coded(why)}</p>
      <div class="tools">
        ${recording && html`<a href=${`/api/v1${address(name)}.mcap`} download>Download it</a>`}
        ${recording && html`<button onClick=${() => (openDialog.value = "delete")}>Delete</button>`}
        <a href="/recordings">All recordings</a>
      </div>
      ${recording && openDialog.value === "delete" && html`<${DeleteDialog} recording=${recording} onClose=${() => (openDialog.value = null)} />`}
    </section>
  `;
}

function Played({ player, summary, events, more, onChanged }) {
  const [chosen, setChosen] = useState(null);
  const { recording } = summary;
  const close = () => (openDialog.value = null);
  const { disturbances, void: reasons } = useFetched(`${address(recording.name)}/disturbances`).body ?? NOTHING;
  const { cars, eye_cameras: eye, car_cameras: own } = summary;
  return html`
    <div class="replay">
      <${Banner} recording=${recording} map=${summary.map_title} />
      <section class="panel stage" aria-label="Replay">
        <${ReplayMap} player=${player} summary=${summary} chosen=${chosen} onChoose=${setChosen} />
        ${player.skipped.value && html`<p class="hint" role="status">${player.skipped.value.words}</p>`}
        ${player.trouble.value && html`<p class="form-error" role="alert">${player.trouble.value}</p>`}
        <${Timeline} player=${player} events=${events} disturbances=${disturbances} begin_ns=${recording.begin_ns} />
        ${reasons.length > 0 && html`<p class="form-error void">Measurements are void: ${reasons.join("; ")}.</p>`}
      </section>
      <${Cars} player=${player} chosen=${chosen} onChoose=${setChosen} />
      ${eye.length + own.length > 0 && html`<${EyeThen} player=${player} eye=${eye} own=${own} chosen=${chosen} />`}
      <${Events} player=${player} events=${events} more=${more} />
      ${openDialog.value === "download" && html`<${DownloadDialog} recording=${recording} cars=${cars} player=${player} onClose=${close} />`}
      ${openDialog.value === "mismatch" &&
      html`<${MismatchDialog} recording=${recording} cars=${cars} player=${player} chosen=${chosen} onClose=${close} />`}
      ${openDialog.value === "notes" && html`<${NotesDialog} recording=${recording} onClose=${close} onChanged=${onChanged} />`}
      ${openDialog.value === "delete" && html`<${DeleteDialog} recording=${recording} onClose=${close} />`}
    </div>
  `;
}

function Banner({ recording, map }) {
  const opens = (what) => () => (openDialog.value = what);
  const facts = [
    recording.begin_ns && moment(recording.begin_ns),
    map,
    minutes(recording.length_s),
    size(recording.size_bytes),
    recording.state === "complete" ? "" : recording.state,
  ].filter(Boolean);
  return html`
    <header class="not-live" role="note">
      <b class="sign">Not live</b>
      <div class="about">
        <h2>${recording.title || recording.name}</h2>
        <p>${facts.join(" · ")}</p>
        <p class="hint">The bar above shows the city now; everything below is recorded.</p>
        ${recording.trouble && html`<p>${recording.trouble}</p>`}
        ${recording.notes && html`<p>“${recording.notes}”</p>`}
      </div>
      <div class="tools">
        <button onClick=${opens("download")}>Download</button>
        <button onClick=${opens("mismatch")}>Mismatch job</button>
        <button onClick=${opens("notes")}>Name and notes</button>
        <button onClick=${opens("delete")}>Delete</button>
        <a href="/recordings">All recordings</a>
      </div>
    </header>
  `;
}

function Cars({ player, chosen, onChoose }) {
  const at_s = player.at.value;
  const state = player.came.value >= 0 ? player.now() : null;
  const cars = state?.cars ?? [];
  return html`
    <section class="panel cars" aria-label="Cars at this moment">
      <div class="panel-head">
        <h2>Cars at ${minutes(at_s, true)} <small>${cars.length}</small></h2>
      </div>
      <div class="scroll" tabindex="0" role="region" aria-label="Table of cars at this moment">
        ${cars.length > 0 &&
        html`
          <table>
            <thead>
              <tr><th>Name</th><th>Kind</th><th>Mode</th><th class="number">Speed</th></tr>
            </thead>
            <tbody>
              ${cars.map((car) => html`<${Car} key=${car.vehicle} car=${car} chosen=${chosen} onChoose=${onChoose} />`)}
            </tbody>
          </table>
        `}
        ${!cars.length && html`<p class="empty">${absent(state, player)}</p>`}
      </div>
    </section>
  `;
}

function absent(state, player) {
  if (!state) return "Reading this moment…";
  if (state.silent && player.t_s < player.first_s) {
    return `The world had not started yet: the first cars appear at ${minutes(player.first_s, true)}.`;
  }
  return state.silent ? "The world was silent at this moment." : "No car was on the map.";
}

function Car({ car, chosen, onChoose }) {
  const is = chosen === car.vehicle;
  const mode = modeOf(car);
  return html`
    <tr data-car=${car.vehicle} class=${is ? "chosen" : ""}>
      <td>
        <button class="name" aria-pressed=${is} onClick=${() => onChoose(is ? null : car.vehicle)}>${car.vehicle}</button>
      </td>
      <td><span class="kind" data-kind=${car.kind}>${car.kind}</span></td>
      <td><span class="mode" data-mode=${mode} title=${stuckBy(car)}>${mode}</span></td>
      <td class="number">${fixed(car.speed_mps, 2)} <small>m/s</small></td>
    </tr>
  `;
}

function Events({ player, events, more }) {
  const at_s = player.at.value + 0.05;
  const here = events.findLast((event) => event.t_s <= at_s)?.number;
  const list = useRef(null);
  useEffect(() => {
    if (!list.current.matches(":hover, :focus-within")) toMiddle(list.current, "[aria-current]");
  }, [here]);
  return html`
    <section class="panel events" aria-label="Events of the recording">
      <div class="panel-head">
        <h2>Events <small>${events.length}${more ? " and more" : ""}</small></h2>
      </div>
      <div class="scroll" tabindex="0" role="region" aria-label="List of events" ref=${list}>
        <ol>
          ${events.map(
            (event) => html`
              <li key=${event.number} data-severity=${event.severity} data-past=${event.t_s <= at_s}>
                <button
                  aria-current=${event.number === here ? "true" : null}
                  onClick=${() => player.seek(event.t_s)}
                >
                  <time>${minutes(event.t_s, true)}</time>
                  <span>${event.severity !== "info" && html`<em>${event.severity}</em> `}${prose(event.text)}</span>
                </button>
              </li>
            `,
          )}
        </ol>
        ${!events.length && html`<p class="empty">No event was recorded.</p>`}
      </div>
    </section>
  `;
}

/** Scroll what a selector names to the middle of its list, and nothing else. */
function toMiddle(list, selector) {
  const found = list.querySelector(selector)?.getBoundingClientRect();
  if (!found) return;
  const frame = list.getBoundingClientRect();
  list.scrollTop += found.top - frame.top - (frame.height - found.height) / 2;
}
