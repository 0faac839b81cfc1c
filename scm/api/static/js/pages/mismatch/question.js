/** What remains undecided, and the drive that would decide it: sent to a car of the city, watched, stopped. */
import { useEffect, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { Dialog } from "scm/shared/dialog.js";
import { byName } from "scm/shared/format.js";
import { change } from "scm/shell/api.js";
import { go } from "scm/shell/router.js";
import { city, useTopics, world } from "scm/shell/store.js";
import { DriveFloor, leavesFloor } from "scm/pages/mismatch/drive_floor.js";
import { useFetched } from "scm/shared/fetched.js";
import { Bar, isActive, useJobs } from "scm/pages/mismatch/jobs.js";
import { ends, Grid, scale, useWidth } from "scm/pages/mismatch/plot.js";
import { short } from "scm/pages/mismatch/words.js";

/** @param number of the question: drives stand in their order */
export function Question({ question, number, report, onDriven }) {
  const { titles, folder } = report.drawn.questions[number];
  const drive = report.drives.includes(folder) ? folder : null;
  const title = report.drawn.cards.filter((panel) => panel.label === "Undecided")[number]?.title ?? titles.join(" or ");
  return html`
    <section class="panel question" aria-label="Undecided: ${titles.join(" or ")}">
      <div class="panel-head">
        <h2><span class="label">Undecided</span>${title}</h2>
      </div>
      <p>${question.drive_this}</p>
      ${drive
        ? html`<${Drive} report=${report} drive=${drive} onDriven=${onDriven} />`
        : html`<p class="empty">No drive on this floor would distinguish them.</p>`}
    </section>
  `;
}

function Drive({ report, drive, onDriven }) {
  useTopics("vehicles");
  const address = `/mismatch/reports/${report.row.name}/drives/${drive}`;
  const { body, error } = useFetched(address);
  const parts = body?.parts ?? null;
  const { jobs, again } = useJobs();
  const [chosen, choose] = useState(null);
  const [number, setNumber] = useState(0);
  const [confirming, setConfirming] = useState(false);
  const cars = world.value.vehicles.toSorted((a, b) => byName(a.vehicle, b.vehicle));
  const alike = cars.filter((car) => car.car === report.drawn.vehicle);
  const car = cars.find((one) => one.vehicle === chosen) ?? alike[0] ?? cars[0] ?? null;
  const mine = jobs.filter((job) => job.kind === "drive" && job.what.startsWith(`${drive} of ${report.row.name} `));
  const now = mine[0] ?? null;
  const driven = mine.filter((job) => job.state === "done").length;
  useEffect(() => {
    if (driven) onDriven();
  }, [driven]);
  if (!parts) return html`<p class="empty" role=${error && "alert"}>${error ?? "Reading the drive …"}</p>`;
  const part = parts[number];
  const play = async () => {
    setConfirming(false);
    const success = () => `${car.vehicle} begins the drive.`;
    if (await change("POST", `${address}/play`, { vehicle: car.vehicle, part: number + 1 }, success)) again();
  };
  return html`
    <div class="drive">
      ${parts.length > 1 && html`<${Parts} count=${parts.length} number=${number} onPick=${setNumber} />`}
      <${Commands} rows=${part.commands} />
      <${DriveFloor} way=${part.way} car=${car} cars=${cars} floor=${city.value?.floor} />
      <div class="send">
        <label>
          Car
          <select value=${car?.vehicle ?? ""} onChange=${(event) => choose(event.target.value)}>
            ${cars.map((one) => html`<option key=${one.vehicle} value=${one.vehicle}>${one.vehicle} (${one.car})</option>`)}
          </select>
        </label>
        <button class="primary" disabled=${!car || (now && isActive(now))} onClick=${() => setConfirming(true)}>
          Drive this with ${car?.vehicle ?? "a car"}
        </button>
      </div>
      <${Warnings} car=${car} report=${report} part=${part} />
      ${now && html`<${Driving} job=${now} again=${again} />`}
      ${report.told > 0 && html`<${SearchAgain} report=${report} />`}
      ${confirming && html`<${ConfirmDrive} car=${car} part=${part} onNo=${() => setConfirming(false)} onYes=${play} />`}
    </div>
  `;
}

/** A drive before and after something was done to the car: each part is sent by itself. */
function Parts({ count, number, onPick }) {
  return html`
    <div class="tabs" role="group" aria-label="Part of the drive">
      ${[...Array(count).keys()].map(
        (i) => html`
          <button key=${i} class="small" aria-pressed=${i === number} onClick=${() => onPick(i)}>
            Part ${i + 1} of ${count}
          </button>
        `,
      )}
    </div>
  `;
}

function Warnings({ car, report, part }) {
  if (!car) return html`<p class="warn">No car is in the city.</p>`;
  const warnings = [];
  if (car.car !== report.drawn.vehicle) {
    warnings.push(`${car.vehicle} is a ${car.car}; the question is about a ${report.drawn.vehicle}.`);
  }
  if (leavesFloor(part.way, car, city.value?.floor)) {
    warnings.push(`From where ${car.vehicle} is now the drive would lead off the floor: it would be refused.`);
  }
  return warnings.map((text) => html`<p class="warn" key=${text}>${text}</p>`);
}

/** Throttle and steering over time. */
function Commands({ rows }) {
  const [ref, width] = useWidth();
  const height = 150;
  const box = { left: 40, right: width - 8, top: 22, bottom: height - 36 };
  const times = rows.map(([t]) => t);
  const x = scale(times[0], times.at(-1), box.left, box.right);
  const [low, high] = ends([rows.map(([, throttle]) => throttle), rows.map(([, , steering]) => steering)], 0);
  const y = scale(low - 0.05, high + 0.05, box.bottom, box.top);
  const held = (column) =>
    rows.map((row, i) => `${i ? "H" : "M"}${x(row[0]).toFixed(1)}${i ? "V" : " "}${y(row[column]).toFixed(1)}`).join("");
  return html`
    <figure ref=${ref}>
      <svg width=${width} height=${height} role="img" aria-label="Commands of the drive over time">
        <${Grid} x=${x} y=${y} box=${box} across="time [s]" up="" write=${short} />
        <path class="curve throttle" d=${held(1)} />
        <path class="curve steering" d=${held(2)} />
      </svg>
      <figcaption class="legend-line">
        <span class="key throttle">throttle</span><span class="key steering">steering, + is left</span>
      </figcaption>
    </figure>
  `;
}

function ConfirmDrive({ car, part, onNo, onYes }) {
  return html`
    <${Dialog} title="Let ${car.vehicle} drive this?" onClose=${onNo}>
      <p>
        ${car.vehicle} comes to rest, then drives ${Math.round(part.lasts_s)} s by these commands, without looking. Keep its way free.
        It ends at the floor's edge, at a hit, by the city stop, or when you stop it; then it is given back, and goes on with the trip it was on.
      </p>
      <div class="actions">
        <button data-first onClick=${onNo}>Not now</button>
        <button class="primary" onClick=${onYes}>Drive</button>
      </div>
    <//>
  `;
}

function Driving({ job, again }) {
  const stop = async () => {
    await change("DELETE", `/operations/${job.id}`, undefined, () => "The drive is stopped.");
    again();
  };
  const words = { done: "Driven and recorded.", cancelled: "The drive was stopped.", failed: job.error };
  return html`
    <div class="driving" data-state=${job.state} role="status">
      ${isActive(job)
        ? html`
            <span>${job.doing || "begins"}</span>
            <${Bar} job=${job} />
            <button class="danger" onClick=${stop}>Stop the drive</button>
          `
        : html`<span>${words[job.state]}</span>`}
    </div>
  `;
}

function SearchAgain({ report }) {
  const [requested, setRequested] = useState(false);
  const search = async () => {
    setRequested(true);
    const success = () => "The search has begun.";
    if (await change("POST", "/mismatch/jobs", { again: report.row.name }, success)) go("/mismatch");
    else setRequested(false);
  };
  const drives = report.told === 1 ? "One drive was" : `${report.told} drives were`;
  return html`
    <div class="send">
      <span>${drives} recorded for this question.</span>
      <button class="primary" disabled=${requested} onClick=${search}>Search again with ${report.told === 1 ? "it" : "them"}</button>
    </div>
  `;
}
