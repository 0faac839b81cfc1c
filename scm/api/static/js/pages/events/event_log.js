/** The log of the city: filtered, folded, followed live, acknowledged, exported. */
import { useEffect, useMemo, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { byName, moment, newestFirst, spaced, span } from "scm/shared/format.js";
import { change } from "scm/shell/api.js";
import { prose } from "scm/shell/prose.js";
import { Dialog } from "scm/shared/dialog.js";
import { stations, topic, useTopics } from "scm/shell/store.js";
import { folded, single } from "scm/pages/events/folding.js";
import { acknowledgedBy, useLiveEvents } from "scm/pages/events/live_events.js";
import { useRested, useRows } from "scm/pages/events/rows.js";

const SEVERITIES = [
  ["error", "Errors", "✕"],
  ["warning", "Warnings", "▲"],
  ["info", "Information", "●"],
];
const CARS_NAMED = 3; // of a row that many cars share
const SIGNS = Object.fromEntries(SEVERITIES.map(([name, , sign]) => [name, sign]));

export function EventLog() {
  useTopics("events", "acknowledgements", "stations");
  const [severity, setSeverity] = useState("");
  const [source, setSource] = useState("");
  const [text, setText] = useState("");
  const [open, setOpen] = useState(false);
  const [foldsRepeats, setFolds] = useState(true);
  const [pausedAt, setPausedAt] = useState(null);
  const [acknowledging, setAcknowledging] = useState(null);
  const wanted = { severity, source, text: useRested(text) };
  const list = useRows("/events", { ...wanted, open: open ? "true" : "" });
  const liveEvents = useLiveEvents();
  useEffect(() => {
    if (pausedAt === null && liveEvents.missed()) list.reload();
  });
  const acknowledged = useMemo(
    () => acknowledgedBy(topic("acknowledgements").value ?? []),
    [topic("acknowledgements").value],
  );
  const rows = merged(list.rows, liveEvents.rows, wanted, acknowledged, open, pausedAt);
  const groups = foldsRepeats ? folded(rows) : single(rows);
  const waiting = rows.filter((row) => !row.acknowledged_by);
  return html`
    <div class="filters" role="search" aria-label="Filter of events">
      <div class="chips" role="group" aria-label="Severity">
        ${SEVERITIES.map(
          ([name, title, sign]) => html`
            <button
              key=${name}
              class="small"
              data-severity=${name}
              aria-pressed=${severity === name}
              onClick=${() => setSeverity(severity === name ? "" : name)}
            ><i aria-hidden="true">${sign}</i>${title} <b>${!severity || severity === name ? count(rows, name) : ""}</b></button>
          `,
        )}
      </div>
      <select aria-label="Source" value=${source} onChange=${(event) => setSource(event.target.value)}>
        <option value="">All sources</option>
        ${sources(rows, source).map((name) => html`<option key=${name} value=${name}>${name}</option>`)}
      </select>
      <input
        type="search"
        placeholder="Find in events"
        aria-label="Find in events"
        value=${text}
        onInput=${(event) => setText(event.target.value)}
      />
      <label class="tick">
        <input type="checkbox" checked=${open} onChange=${(event) => setOpen(event.target.checked)} />
        Not acknowledged
      </label>
      <label class="tick" title="Events of one kind as one row with their number; errors always stand alone">
        <input type="checkbox" checked=${foldsRepeats} onChange=${(event) => setFolds(event.target.checked)} />
        Fold repeats
      </label>
      <span class="room"></span>
      <button class="small" aria-pressed=${pausedAt !== null} onClick=${() =>
        setPausedAt(pausedAt === null ? (liveEvents.rows[0]?.seq ?? 0) : null)}>
        ${pausedAt === null ? "Pause" : "Follow"}
      </button>
      <button class="small" disabled=${!waiting.length} onClick=${() => setAcknowledging(waiting)}>
        Acknowledge all ${waiting.length}
      </button>
      <${Export} path="/events" query=${list.query} />
    </div>
    ${list.error && html`<p class="empty warn" role="alert">The log could not be read: ${list.error}</p>`}
    ${pausedAt !== null && html`<p class="paused" role="status">Paused: new events are not shown.</p>`}
    <div class="scroll" tabindex="0" role="log" aria-label="Log of events, newest first">
      <ol class="entries">
        ${groups.map(
          (group) => html`<${Group} key=${group.key} group=${group} onAcknowledge=${setAcknowledging} />`,
        )}
      </ol>
      ${!groups.length && !list.more &&
      html`<p class="empty">${list.loading ? "Reading the log." : empty(wanted, open)}</p>`}
      ${list.more &&
      html`<button class="more" disabled=${list.loading} onClick=${list.loadMore}>Older events</button>`}
    </div>
    ${acknowledging && html`<${AcknowledgeDialog} rows=${acknowledging} onClose=${() => setAcknowledging(null)} />`}
  `;
}

/** Rows read and rows that came since, newest first, each once, with the newest acknowledgements. */
function merged(read, live, wanted, acknowledged, open, pausedAt) {
  const rows = new Map();
  for (const row of [...live.filter((row) => passes(row, wanted)), ...read]) {
    if (rows.has(row.id) || (pausedAt !== null && row.seq > pausedAt)) continue;
    const full = { ...row, ...acknowledged(row) };
    if (!(open && full.acknowledged_by)) rows.set(row.id, full);
  }
  return [...rows.values()].toSorted(newestFirst);
}

function passes(row, { severity, source, text }) {
  const words = spaced(`${row.text} ${row.name} ${row.source}`.toLowerCase());
  return (
    (!severity || row.severity === severity) &&
    (!source || row.source === source) &&
    words.includes(spaced(text.toLowerCase()))
  );
}

const count = (rows, severity) => rows.filter((row) => row.severity === severity).length;

function sources(rows, chosen) {
  const names = [...rows.map((row) => row.source), ...stations.value.map((one) => one.name), chosen];
  return [...new Set(names)].filter(Boolean).toSorted(byName);
}

function empty({ severity, source, text }, open) {
  return severity || source || text || open
    ? "No event fits this filter."
    : "Nothing has happened yet.";
}

function Group({ group, onAcknowledge }) {
  const [whole, setWhole] = useState(false);
  const { newest, oldest, events, vehicles } = group;
  const open = events.filter((event) => !event.acknowledged_by);
  return html`
    <li data-severity=${newest.severity} data-open=${open.length > 0} data-name=${newest.name} data-count=${events.length}>
      <time>${moment(newest.t_ns)}</time>
      <i class="sign" role="img" aria-label=${newest.severity}>${SIGNS[newest.severity]}</i>
      <span class="event-text">
        ${prose(newest.text)}
        ${events.length > 1 &&
        html`
          <button class="small repeats" aria-expanded=${whole} onClick=${() => setWhole(!whole)}>
            ${events.length} times in ${span((newest.t_ns - oldest.t_ns) / 1e9)}, since ${moment(oldest.t_ns)}
          </button>
        `}
      </span>
      <span class="about">
        <span>${newest.source}</span>
        ${vehicles.slice(0, CARS_NAMED).map((name) => html`<a key=${name} href="/vehicles/${name}">${name}</a>`)}
        ${vehicles.length > CARS_NAMED &&
        html`<span title=${vehicles.toSorted(byName).join(", ")}>+${vehicles.length - CARS_NAMED}</span>`}
      </span>
      <span class="mark">
        ${open.length
          ? html`
              <button
                class="small"
                aria-label="Acknowledge: ${prose(newest.text)}"
                onClick=${() => onAcknowledge(open)}
              >Acknowledge</button>
            `
          : html`<${Seen} event=${newest} />`}
      </span>
      ${whole &&
      html`
        <ol class="single">
          ${events.map((event) => html`<li key=${event.id}><time>${moment(event.t_ns)}</time>${prose(event.text)}</li>`)}
        </ol>
      `}
    </li>
  `;
}

function Seen({ event }) {
  const words = event.note ? `${event.acknowledged_by}: ${event.note}` : `seen by ${event.acknowledged_by}`;
  const withdraw = () => change("DELETE", `/events/acknowledgements/${event.id}`);
  return html`
    <small title=${words}>✓ ${words}</small>
    <button class="plain" aria-label="Withdraw: ${prose(event.text)}" title="Withdraw the acknowledgement" onClick=${withdraw}>↶</button>
  `;
}

function AcknowledgeDialog({ rows, onClose }) {
  const submit = (event) => {
    event.preventDefault();
    const note = event.target.elements.note.value;
    onClose();
    const body = { events: rows.slice(0, 1000).map((row) => row.id), note };
    change("POST", "/events/acknowledgements", body, ({ acknowledgements }) =>
      acknowledgements.length === 1 ? "Acknowledged." : `${acknowledgements.length} events acknowledged.`,
    );
  };
  const title = rows.length === 1 ? "Acknowledge this event?" : `Acknowledge ${rows.length} events?`;
  return html`
    <${Dialog} title=${title} onClose=${onClose}>
      <p>${rows.length === 1 ? prose(rows[0].text) : "Everybody sees that somebody took note of them."}</p>
      <form onSubmit=${submit}>
        <input name="note" maxlength="500" placeholder="Note (optional)" aria-label="Note" />
        <div class="actions">
          <button type="button" onClick=${onClose}>Cancel</button>
          <button class="primary" data-first>Acknowledge</button>
        </div>
      </form>
    <//>
  `;
}

/** Downloads of what the filter lets through. */
export function Export({ path, query }) {
  return html`
    <span class="export">
      <span>Export</span>
      <a href="/api/v1${path}.csv?${query}" download>CSV</a>
      <a href="/api/v1${path}.jsonl?${query}" download>JSON Lines</a>
    </span>
  `;
}
