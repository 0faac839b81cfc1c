/** All reports, what runs now, and the form that starts a search. */
import { useEffect, useRef, useState } from "preact/hooks";
import { moment } from "scm/shared/format.js";
import { html } from "scm/shared/html.js";
import { useFetched } from "scm/shared/fetched.js";
import { isActive, Jobs, useJobs } from "scm/pages/mismatch/jobs.js";
import { StartForm } from "scm/pages/mismatch/start_form.js";
import { length, verdictOf } from "scm/pages/mismatch/words.js";

export function List() {
  const reports = useFetched("/mismatch/reports?limit=200");
  const { jobs, again } = useJobs();
  const done = jobs.filter((job) => !isActive(job)).length;
  const before = useRef(done);
  useEffect(() => {
    if (before.current !== done) reports.again(); // what ended may have left a report
    before.current = done;
  }, [done]);
  return html`
    <div class="list">
      <${Reports} rows=${reports.body?.items} error=${reports.error} />
      <div class="side">
        <${StartForm} onStarted=${again} />
        <${Jobs} jobs=${jobs} again=${again} />
      </div>
    </div>
  `;
}

function Reports({ rows, error }) {
  const [wanted, setWanted] = useState("");
  const shown = (rows ?? []).filter((row) => matches(row, wanted));
  return html`
    <section class="panel reports" aria-label="Reports">
      <div class="panel-head">
        <h2>What the simulator left out <small>${rows ? `${rows.length} reports` : ""}</small></h2>
        <input
          type="search"
          placeholder="Find"
          aria-label="Find a report"
          value=${wanted}
          onInput=${(event) => setWanted(event.target.value)}
        />
      </div>
      ${error && html`<p class="why" role="alert">${error}</p>`}
      ${!rows && !error && html`<p class="empty">Reading the reports …</p>`}
      ${rows && !rows.length && html`<${Nothing} />`}
      ${rows && rows.length > 0 && !shown.length && html`<p class="empty">No report matches “${wanted}”.</p>`}
      <ul class="cards">${shown.map((row) => html`<${Row} key=${row.name} row=${row} />`)}</ul>
    </section>
  `;
}

function Nothing() {
  return html`
    <div class="empty nothing">
      <p><b>No report yet.</b></p>
      <p>
        A search drives a recording again with the simulator, finds where the two differ, and says in
        words which physics was left out, how much, and how sure that is. It needs a minute or two of
        driving: a run of this city, or a recording of your own car.
      </p>
    </div>
  `;
}

function Row({ row }) {
  const verdict = verdictOf(row);
  return html`
    <li data-verdict=${verdict.kind}>
      <a href="/mismatch/${row.name}">
        <span class="verdict"><i aria-hidden="true">${verdict.sign}</i>${verdict.word}</span>
        <b>${row.said || row.name}</b>
        <span class="facts">
          <span>${row.name}</span>
          <span>${[row.vehicle, row.source].filter(Boolean).join(", ")}</span>
          <span>${moment(row.made_ns)}</span>
        </span>
        ${row.before_m !== null && row.after_m !== null && html`<${Gain} row=${row} />`}
      </a>
    </li>
  `;
}

/** How far free runs stray on unseen parts, before and after, as two bars. */
function Gain({ row }) {
  const most = Math.max(row.before_m, row.after_m) || 1;
  const bar = (kind, value) => html`
    <span class="bar" data-side=${kind} style=${{ width: `${Math.max(2, (100 * value) / most)}%` }}></span>
  `;
  return html`
    <span class="gain" aria-label="Error on unseen parts ${length(row.before_m)}, then ${length(row.after_m)}">
      <span>${bar("before", row.before_m)}<em>${length(row.before_m)} off before</em></span>
      <span>${bar("after", row.after_m)}<em>${length(row.after_m)} after</em></span>
    </span>
  `;
}

function matches(row, wanted) {
  const text = [row.name, row.said, row.vehicle, row.source, row.verdict].join(" ").toLowerCase();
  return wanted.toLowerCase().split(/\s+/).every((word) => text.includes(word));
}
