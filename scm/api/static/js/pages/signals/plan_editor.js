/** The plan editor: stages in their order, checked as they are typed, proven before they can be saved. */
import { signal } from "@preact/signals";
import { html } from "scm/shared/html.js";
import { change, notify } from "scm/shell/api.js";
import { clock } from "scm/shared/format.js";
import { finished } from "scm/shared/operation.js";
import { prose } from "scm/shell/prose.js";
import { changeOf, cycleOf, goingOn, PlanStrip, splitOf } from "scm/pages/signals/plan_strip.js";
import { junction, plans, read, readPlans, site } from "scm/pages/signals/store.js";
import { plain, secs } from "scm/pages/signals/words.js";

const LONGEST_CYCLE_S = 300;
const MOST_STAGES = 24;
const NAME = /^[a-z][a-z0-9_-]{0,31}$/;

/**
 * The plan in the editor: `{junction, plan, about, offset_s, stages, isNew, tag, existing}`; null: it is closed.
 * It is retained while the user looks elsewhere. `existing` is the plan as somebody else saved it meanwhile.
 */
export const editing = signal(null);

/** The search: `{of, state, words}`; `of` is what it proves, as text. */
const search = signal(null);

let tried = 0;

const contentOf = (draft) => JSON.stringify(draft.stages);

/** Open the editor: on a saved plan, on a copy of a shipped one, or on a first cycle of all groups. */
export async function edit(plan) {
  search.value = null;
  const own = { junction: junction.value, existing: null };
  const copy = (stages) => stages.map((stage) => ({ ...stage, groups: [...stage.groups] }));
  if (plan?.source === "saved") {
    const found = await read(`/signals/${junction.value}/plans/${plan.plan}`).catch((error) => {
      notify("error", error.message);
      return null;
    });
    if (!found) return;
    const { about, offset_s, stages } = found.body;
    editing.value = { ...own, plan: plan.plan, about, offset_s, stages: copy(stages), isNew: false, tag: found.tag };
    if (plan.usable) search.value = { of: contentOf(editing.value), state: "proven", words: proofWords(found.body.proof) };
    return;
  }
  const stages = plan
    ? plan.stages
    : (site.value?.phases ?? []).map((phase) => ({
        groups: [phase.group],
        green_s: 2 * phase.min_green_s,
        extra_red_s: 0,
      }));
  const offset_s = typeof plan?.offset_s === "number" ? Math.round(10 * plan.offset_s) / 10 : null;
  const named = plan ? { plan: `${plan.plan}-copy`, about: `copy of ${plan.plan}` } : { plan: "", about: "" };
  editing.value = { ...own, ...named, offset_s, stages: copy(stages), isNew: true, tag: null };
}

/** @returns all that is wrong with a draft, in words; what only the search can find is not among it. */
export function faultsOf(draft) {
  const faults = [];
  const phases = new Map((site.value?.phases ?? []).map((phase) => [phase.group, phase]));
  const conflicts = site.value?.conflicts ?? [];
  draft.stages.forEach((stage, at) => {
    const where = `Stage ${at + 1}`;
    if (!stage.groups.length) faults.push(`${where} has no group.`);
    for (const [one, other] of conflicts) {
      if (stage.groups.includes(one) && stage.groups.includes(other)) {
        faults.push(`${where}: ${plain(one)} and ${plain(other)} conflict and cannot share it.`);
      }
    }
    const least = Math.max(0, ...stage.groups.map((group) => phases.get(group)?.min_green_s ?? 0));
    if (!(stage.green_s >= least - 1e-9)) faults.push(`${where}: green is below the min green of ${secs(least)}.`);
    if (!(stage.extra_red_s >= 0)) faults.push(`${where}: extra red must be 0 or more.`);
  });
  for (const group of phases.keys()) {
    if (!draft.stages.some((stage) => stage.groups.includes(group))) faults.push(`${plain(group)} is never green.`);
  }
  const cycle = cycleOf(draft.stages);
  if (cycle > LONGEST_CYCLE_S) faults.push(`The cycle of ${secs(cycle)} is longer than ${LONGEST_CYCLE_S} s.`);
  if (draft.offset_s !== null && !(draft.offset_s >= 0 && draft.offset_s < cycle)) {
    faults.push(`Offset: from 0 to less than the cycle of ${secs(cycle)}, or empty.`);
  }
  return faults;
}

/** @returns what is right and may surprise: phases that stay green from a stage into the next one. */
function remarksOf({ stages }) {
  return stages.flatMap((_, at) => {
    const next = (at + 1) % stages.length;
    const both = goingOn(stages, at).map(plain);
    if (!both.length) return [];
    const they = both.length > 1 ? "they stay" : "it stays";
    const while_ = next ? "" : ", from cycle to cycle while this plan runs";
    return [`Stages ${at + 1} and ${next + 1} both have ${both.join(" and ")}: ${they} green between them${while_}.`];
  });
}

function nameFault(draft) {
  if (!NAME.test(draft.plan)) return "Name: small letters, digits, - and _, beginning with a letter.";
  if (!draft.isNew) return "";
  const names = [...plans.value.map((one) => one.plan), ...(site.value?.policies ?? []).map((one) => one.policy), "flash"];
  return names.includes(draft.plan) ? `There is something named ${draft.plan} already.` : "";
}

export function PlanEditor() {
  const draft = editing.value;
  const faults = faultsOf(draft);
  const unnamed = nameFault(draft);
  const found = search.value?.of === contentOf(draft) ? search.value : null;
  const isProven = found?.state === "proven";
  const put = (changes) => (editing.value = { ...draft, ...changes });
  const putStage = (at, changes) =>
    put({ stages: draft.stages.map((stage, i) => (i === at ? { ...stage, ...changes } : stage)) });
  const move = (at, by) => {
    const stages = [...draft.stages];
    [stages[at], stages[at + by]] = [stages[at + by], stages[at]];
    put({ stages });
  };
  const scale = (event) => {
    const wanted = Number(event.target.value);
    const greens = draft.stages.reduce((sum, stage) => sum + stage.green_s, 0);
    const rest = cycleOf(draft.stages) - greens;
    if (!(wanted > rest) || !(greens > 0)) return;
    const factor = (wanted - rest) / greens;
    put({ stages: draft.stages.map((s) => ({ ...s, green_s: Math.round(10 * s.green_s * factor) / 10 })) });
  };
  return html`
    <section class="panel editor" aria-label="Plan editor">
      <div class="panel-head">
        <h2>${draft.isNew ? "New plan" : `Plan ${draft.plan}`} <small>for ${plain(junction.value)}</small></h2>
        <button class="small" onClick=${() => (editing.value = null)}>Close</button>
      </div>
      <div class="naming">
        <label>
          <span>Name</span>
          <input
            id="plan-name"
            value=${draft.plan}
            disabled=${!draft.isNew}
            maxlength="32"
            placeholder="rush"
            onInput=${(event) => put({ plan: event.target.value.trim() })}
          />
        </label>
        <label class="about">
          <span>What it is for</span>
          <input
            id="plan-about"
            value=${draft.about}
            maxlength="200"
            placeholder="more green for the east in the morning"
            onInput=${(event) => put({ about: event.target.value })}
          />
        </label>
        <label>
          <span>Cycle, s (stretches greens)</span>
          <input key=${cycleOf(draft.stages)} type="number" id="plan-cycle" step="0.1" min="1" max=${LONGEST_CYCLE_S} defaultValue=${cycleOf(draft.stages).toFixed(1)} onChange=${scale} />
        </label>
        <label>
          <span>Offset, s (empty: in step with nobody)</span>
          <input
            type="number"
            id="plan-offset"
            step="0.1"
            min="0"
            max=${LONGEST_CYCLE_S}
            value=${draft.offset_s ?? ""}
            onInput=${({ target }) => put({ offset_s: target.value === "" ? null : Number(target.value) })}
          />
        </label>
      </div>
      <${PlanStrip} stages=${draft.stages} tall=${true} />
      <div class="scroll" tabindex="0" role="region" aria-label="Table of stages">
        <table>
          <caption class="hidden">Stages in the order of the cycle</caption>
          <thead>
            <tr>
              <th scope="col">Stage</th>
              <th scope="col">Phases</th>
              <th scope="col" class="number">Min green</th>
              <th scope="col" class="number">Green, s</th>
              <th scope="col" class="number">Yellow change</th>
              <th scope="col" class="number">Red clear</th>
              <th scope="col" class="number">Extra red, s</th>
              <th scope="col" class="number">Split</th>
              <th scope="col"><span class="hidden">Order</span></th>
            </tr>
          </thead>
          <tbody>
            ${draft.stages.map(
              (_, at) => html`
                <${Stage}
                  key=${at}
                  at=${at}
                  stages=${draft.stages}
                  onPut=${(changes) => putStage(at, changes)}
                  onMove=${(by) => move(at, by)}
                  onRemove=${() => put({ stages: draft.stages.filter((_, i) => i !== at) })}
                />
              `,
            )}
          </tbody>
        </table>
      </div>
      <p class="why">
        Min green, yellow change and red clear belong to the signal kernel, not to a plan: they follow from the map and
        the slowest and fastest cars that drive here, so nobody can make them too short; they count for the phases that
        leave a stage, and after the last one for all. What you set is green and extra red. A cycle with an offset begins so long after whole cycles of the city's clock: junctions with the same
        cycle keep step, and the first green of a cycle is longer until they do.
      </p>
      ${remarksOf(draft).map((one) => html`<p key=${one} class="remark" role="status">${one}</p>`)}
      <div class="foot">
        <button
          class="small"
          disabled=${draft.stages.length >= MOST_STAGES}
          onClick=${() => put({ stages: [...draft.stages, { groups: [], green_s: 5, extra_red_s: 0 }] })}
        >
          Add a stage
        </button>
        <${Verdict} faults=${faults} found=${found} />
        <div class="acts">
          <button disabled=${faults.length > 0 || isProven || found?.state === "running"} onClick=${() => prove(draft)}>
            ${isProven ? "Proven" : "Prove"}
          </button>
          <button class="primary" disabled=${!isProven || Boolean(unnamed)} title=${unnamed} onClick=${() => save(draft)}>
            ${draft.existing ? "Save over it" : "Save"}
          </button>
        </div>
      </div>
      ${draft.existing && html`<p class="fault" role="alert">${existingText(draft.existing)}</p>`}
      ${draft.plan && unnamed && html`<p class="fault" role="status">${unnamed}</p>`}
    </section>
  `;
}

function Stage({ at, stages, onPut, onMove, onRemove }) {
  const stage = stages[at];
  const count = stages.length;
  const phases = site.value?.phases ?? [];
  const least = Math.max(0, ...phases.filter((p) => stage.groups.includes(p.group)).map((p) => p.min_green_s));
  const { yellow_s, red_clear_s } = changeOf(stages, at);
  const flip = (group) =>
    onPut({
      groups: phases
        .map((phase) => phase.group)
        .filter((one) => (one === group) !== stage.groups.includes(one)),
    });
  const number = (event) => Number(event.target.value);
  return html`
    <tr>
      <th scope="row">${at + 1}</th>
      <td class="chips" data-name="Phases">
        ${phases.map(
          (phase) => html`
            <label key=${phase.group} class="chip">
              <input
                type="checkbox"
                checked=${stage.groups.includes(phase.group)}
                onChange=${() => flip(phase.group)}
              />${plain(phase.group)}
            </label>
          `,
        )}
      </td>
      <td class="number" data-name="Min green">${secs(least)}</td>
      <td class="number" data-name="Green, s">
        <input
          type="number"
          aria-label="Green of stage ${at + 1} in seconds"
          step="0.1"
          min="0"
          max="300"
          value=${stage.green_s}
          onInput=${(event) => onPut({ green_s: number(event) })}
        />
      </td>
      <td class="number" data-name="Yellow change">${secs(yellow_s)}</td>
      <td class="number" data-name="Red clear">${secs(red_clear_s)}</td>
      <td class="number" data-name="Extra red, s">
        <input
          type="number"
          aria-label="Extra red after stage ${at + 1} in seconds"
          step="0.1"
          min="0"
          max="300"
          value=${stage.extra_red_s}
          onInput=${(event) => onPut({ extra_red_s: number(event) })}
        />
      </td>
      <td class="number" data-name="Split"><b>${secs(splitOf(stages, at))}</b></td>
      <td class="order">
        <button class="small" aria-label="Stage ${at + 1} earlier" disabled=${at === 0} onClick=${() => onMove(-1)}>▲</button>
        <button class="small" aria-label="Stage ${at + 1} later" disabled=${at === count - 1} onClick=${() => onMove(1)}>▼</button>
        <button class="small" aria-label="Remove stage ${at + 1}" disabled=${count === 1} onClick=${onRemove}>✕</button>
      </td>
    </tr>
  `;
}

function Verdict({ faults, found }) {
  if (faults.length) {
    const list = faults.map((one) => html`<li key=${one}>${one}</li>`);
    return html`<div class="verdict" data-state="bad" role="status"><ul>${list}</ul></div>`;
  }
  if (!found) {
    return html`<p class="verdict" role="status">Nothing is wrong at sight. The search has to prove it before it can be saved.</p>`;
  }
  const state = { proven: "good", failed: "bad", running: "busy" }[found.state];
  return html`<p class="verdict" data-state=${state} role="status">${prose(found.words)}</p>`;
}

function proofWords(proof) {
  const many = (n) => n.toLocaleString("en").replaceAll(",", " ");
  return (
    `Proven: ${many(proof.states)} states and ${many(proof.transitions)} steps of the kernel under any requests, ` +
    `${many(proof.plan_states)} states and ${many(proof.plan_transitions)} steps of this plan; cycle ${secs(proof.cycle_s)}.`
  );
}

/** Let the server search; what is typed meanwhile makes its answer one of something else. */
async function prove(draft) {
  const [of, mine] = [contentOf(draft), (tried += 1)];
  const notifyState = (state, words) => mine === tried && (search.value = { of, state, words });
  notifyState("running", "The search walks through every state of kernel and plan…");
  const plan = NAME.test(draft.plan) ? draft.plan : "draft";
  const begun = await change("POST", `/signals/${junction.value}/proofs`, { plan, stages: draft.stages });
  if (!begun) return notifyState("failed", "The search did not begin.");
  try {
    const row = await finished(begun);
    if (row.state !== "done") return notifyState("failed", `Not proven: ${row.error || row.state}`);
    const { body } = await read(row.result.replace("/api/v1", ""));
    return notifyState("proven", proofWords(body));
  } catch (error) {
    return notifyState("failed", error.message);
  }
}

function existingText({ plan, by, about, saved_ns }) {
  const what = about ? ` (${about})` : "";
  return `${by || "Somebody"} saved ${plan}${what} at ${clock(saved_ns)}, after you began. Close to see that one, or save yours over it.`;
}

async function save(draft) {
  const headers = draft.isNew ? { "If-None-Match": "*" } : { "If-Match": draft.tag };
  const { about, offset_s, stages } = draft;
  const body = { about, offset_s, stages, by: "dashboard", reason: "edited on the dashboard" };
  const path = `/signals/${junction.value}/plans/${draft.plan}`;
  const reply = await change("PUT", path, body, () => `Plan ${draft.plan} is saved.`, headers);
  if (!reply) return catchUp(draft, path);
  editing.value = null;
  await readPlans();
}

/** It was refused: somebody was faster, took the plan away, or the server forgot what it had proven. */
async function catchUp(draft, path) {
  const found = await read(path).catch((error) => ({ body: null, tag: null, status: error.status }));
  if (editing.value?.junction !== draft.junction || editing.value.plan !== draft.plan) return;
  const isGone = found.status === 404;
  if (found.body && found.tag !== draft.tag) {
    editing.value = { ...editing.value, isNew: false, tag: found.tag, existing: found.body };
  } else if (isGone && !draft.isNew) {
    editing.value = { ...editing.value, isNew: true, tag: null, existing: null };
  } else if (found.body || isGone) {
    search.value = null;
  }
}
