/** Who changed what, when, by which request, and how it ended; and whether the chain is whole. */
import { useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { moment } from "scm/shared/format.js";
import { folded } from "scm/pages/events/audit_calls.js";
import { Export } from "scm/pages/events/event_log.js";
import { useRested, useRows } from "scm/pages/events/rows.js";
import { placed } from "scm/shared/base.js";

const STATIONS = ["api", "world", "traffic", "monitor"];

export function AuditTrail() {
  const [station, setStation] = useState("");
  const [by, setBy] = useState("");
  const [text, setText] = useState("");
  const list = useRows("/audit", { station, by: useRested(by), text: useRested(text) });
  return html`
    <div class="filters" role="search" aria-label="Filter of the audit">
      <select aria-label="Done by" value=${station} onChange=${(event) => setStation(event.target.value)}>
        <option value="">All stations</option>
        ${STATIONS.map((name) => html`<option key=${name} value=${name}>${name}</option>`)}
      </select>
      <input type="search" placeholder="Asked by" aria-label="Asked by" value=${by}
        onInput=${(event) => setBy(event.target.value)} />
      <input type="search" placeholder="Find in the audit trail" aria-label="Find in the audit trail" value=${text}
        onInput=${(event) => setText(event.target.value)} />
      <span class="room"></span>
      <${Chain} />
      <button class="small" onClick=${list.reload}>Read again</button>
      <${Export} path="/audit" query=${list.query} />
    </div>
    ${list.error && html`<p class="empty warn" role="alert">The audit could not be read: ${list.error}</p>`}
    <div class="scroll" tabindex="0" role="region" aria-label="Deeds, newest first">
      <table>
        <thead>
          <tr>
            <th class="number">No.</th><th>When</th><th>What</th><th>Asked by</th>
            <th>Done by</th><th>Answer</th>
          </tr>
        </thead>
        <tbody>
          ${folded(list.rows).map(
            ({ row, call }) => html`<${Deed} key=${row.number} row=${row} call=${call} onTrace=${setText} />`,
          )}
        </tbody>
      </table>
      ${!list.rows.length &&
      html`<p class="empty">${list.loading ? "Reading the audit." : "Nobody changed anything that fits."}</p>`}
      ${list.more &&
      html`<button class="more" disabled=${list.loading} onClick=${list.loadMore}>Older entries</button>`}
    </div>
  `;
}

function Deed({ row, call, onTrace }) {
  const [whole, setWhole] = useState(false);
  const { ended, bad } = outcome(row);
  const isRead = row.kind !== "unreadable";
  const entries = call ? [row, call] : [row];
  return html`
    <tr data-request=${row.number}>
      <td class="number">${entries.map(({ number }) => number).join(", ")}</td>
      <td class="when">${isRead && html`<time>${moment(row.t_ns)}</time>`}</td>
      <td class="what">
        <button class="name" aria-expanded=${whole} onClick=${() => setWhole(!whole)}>${row.text}</button>
        ${row.request.reason && html` <small>${row.request.reason}</small>`}
      </td>
      <td class="by">${row.by}${call && !row.by.includes(call.by) && html` <small>${call.by}</small>`}</td>
      <td class="station">${entries.map(({ station }) => station).join(", ")}</td>
      <td class="answer ${bad ? "warn" : ""}">${ended}${call && html` <small>${outcome(call).ended}</small>`}</td>
    </tr>
    ${whole &&
    html`
      <tr class="whole">
        <td colspan="6">
          ${row.trace_id &&
          html`<p class="trace">Trace <code>${row.trace_id}</code>
            <button class="small" onClick=${() => onTrace(row.trace_id)}>All that this led to</button></p>`}
          ${entries.map((entry) => html`<pre tabindex="0">${inFull(entry)}</pre>`)}
        </td>
      </tr>
    `}
  `;
}

function inFull({ number, station, kind, request, reply, request_id }) {
  return JSON.stringify({ number, station, kind, request, reply, request_id }, null, 2);
}

/** How a request ended, in a word or two. */
function outcome({ station, kind, reply }) {
  if (kind === "unreadable") return { ended: kind, bad: true };
  if (station === "api") return { ended: `${reply.status} in ${reply.ms} ms`, bad: reply.status >= 400 };
  const refused = reply.code !== undefined && reply.detail !== undefined;
  return { ended: refused ? `refused: ${reply.code}` : "done", bad: refused };
}

function Chain() {
  const [verdict, setVerdict] = useState(null);
  const check = async () => {
    setVerdict({ words: "checking" });
    try {
      const response = await fetch(placed("/api/v1/audit/verdict"));
      const body = await response.json();
      if (!response.ok) throw new Error(body.detail || body.title);
      const words = body.whole ? `whole: ${body.entries} entries` : body.error;
      setVerdict({ words, bad: !body.whole, digest: body.digest });
    } catch (error) {
      setVerdict({ words: error.message, bad: true });
    }
  };
  return html`
    <span class="chain" role="status">
      ${verdict && html`<span class=${verdict.bad ? "warn" : ""} title=${verdict.digest ?? ""}>${verdict.words}</span>`}
    </span>
    <button class="small" onClick=${check}>Check the chain</button>
  `;
}
