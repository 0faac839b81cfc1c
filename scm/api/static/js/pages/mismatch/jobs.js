/** Searches and drives that run, wait or ended lately: each with its progress, and a way to end it. */
import { html } from "scm/shared/html.js";
import { change } from "scm/shell/api.js";
import { useFetched } from "scm/shared/fetched.js";
import { span } from "scm/shared/format.js";

const KINDS = new Set(["mismatch", "drive"]);
const ACTIVE = new Set(["waiting", "running"]);
const OFTEN_MS = 700;
const WORDS = { waiting: "waiting", running: "running", done: "done", failed: "failed", cancelled: "called off" };

export const isActive = (job) => ACTIVE.has(job.state);

/** @returns `{jobs, again}`: newest first; read often while one is active. */
export function useJobs() {
  const { body, again } = useFetched("/operations?limit=100", OFTEN_MS);
  return { jobs: (body?.items ?? []).filter((job) => KINDS.has(job.kind)), again };
}


export function Jobs({ jobs, again }) {
  if (!jobs.length) return null;
  return html`
    <section class="panel jobs" aria-label="Searches and drives">
      <div class="panel-head"><h2>Searches and drives</h2></div>
      <ul>${jobs.slice(0, 12).map((job) => html`<${Job} key=${job.id} job=${job} again=${again} />`)}</ul>
    </section>
  `;
}

function Job({ job, again }) {
  const end = async () => {
    await change("DELETE", `/operations/${job.id}`, undefined, () => `${job.what} is called off.`);
    again();
  };
  return html`
    <li data-state=${job.state}>
      <div class="line">
        <b>${job.kind === "drive" ? "Drive" : "Search"} · ${job.what}</b>
        <span class="state">${WORDS[job.state]}</span>
      </div>
      ${isActive(job) && html`<${Bar} job=${job} />`}
      ${job.error && html`<p class="why">${job.error}</p>`}
      <div class="line">
        <small>${isActive(job) ? job.doing : ended(job)}</small>
        ${isActive(job) && html`<button class="small" onClick=${end}>Call off</button>`}
        ${job.state === "done" && job.kind === "mismatch" && html`<a href=${job.result}>Open the report</a>`}
      </div>
    </li>
  `;
}

export function Bar({ job }) {
  const share = job.progress ?? 0;
  return html`
    <progress max="1" value=${share} aria-label="Progress of ${job.what}"></progress>
  `;
}

function ended(job) {
  if (!job.began_ns || !job.ended_ns) return "";
  return `after ${span((job.ended_ns - job.began_ns) / 1e9)}`;
}
