/** What may run: plans and policies, which one does, and what each is for. */
import { signal } from "@preact/signals";
import { html } from "scm/shared/html.js";
import { change, notify } from "scm/shell/api.js";
import { Dialog } from "scm/shared/dialog.js";
import { edit } from "scm/pages/signals/plan_editor.js";
import { PlanStrip } from "scm/pages/signals/plan_strip.js";
import { plans, read, readPlans, row, site, status } from "scm/pages/signals/store.js";
import { plain, secs, toCome } from "scm/pages/signals/words.js";

/** `{plan}` or `{policy}` that is to be confirmed. */
const confirming = signal(null);
const deleting = signal(null);

export function Plans({ current }) {
  const now = status();
  const policies = (site.value?.policies ?? []).filter(
    (one) => !["fixed", "flashing"].includes(one.policy), // the plans, and the button for flash
  );
  return html`
    <section class="panel plans" aria-label="Plans">
      <div class="panel-head">
        <h2>Plans and policies</h2>
        <button class="small" disabled=${!site.value} onClick=${() => edit(null)}>New plan…</button>
      </div>
      <ul class="choices">
        ${plans.value.map((plan) => html`<${Plan} key=${plan.plan} plan=${plan} now=${now} current=${current} />`)}
        ${policies.map((one) => html`<${Policy} key=${one.policy} of=${one} now=${now} />`)}
        ${!plans.value.length && html`<li class="empty">Reading what the controller offers…</li>`}
      </ul>
      ${confirming.value && html`<${Run} junction=${current.junction} wanted=${confirming.value} />`}
      ${deleting.value && html`<${Delete} junction=${current.junction} plan=${deleting.value} />`}
    </section>
  `;
}

/** Whether a plan was edited since it began to run: the junction runs what it was given. */
export function isEdited(plan, now) {
  if (!now?.stages.length) return false;
  const whole = (s) => Math.ceil(10 * s - 1e-9); // in steps of the signals, as the controller counts
  const textOf = (stages) => JSON.stringify(stages.map((s) => [s.groups.toSorted(), whole(s.green_s), whole(s.extra_red_s)]));
  return textOf(plan.stages) !== textOf(now.stages) || plan.offset_s !== now.offset_s;
}

function Plan({ plan, now, current }) {
  const runs = current.fresh && current.mode !== "flash" && now?.policy === "fixed" && now.plan === plan.plan;
  const next = now?.pending === plan.plan;
  const edited = runs && !next && isEdited(plan, now);
  return html`
    <li data-runs=${runs} data-plan=${plan.plan}>
      <div class="what">
        <b>${plan.plan}</b>
        ${runs && html`<span class="badge on">runs</span>`}
        ${next && html`<span class="badge">next</span>`}
        ${edited && html`<span class="badge" data-usable="false">edited since</span>`}
        ${plan.source === "saved" && html`<span class="badge" data-usable=${plan.usable}>${plan.usable ? "proven" : "not proven"}</span>`}
        <small>${plan.about || "no words about it"}</small>
        ${edited && html`<small class="warn">It runs as it was before; Run… lets this one come.</small>`}
      </div>
      <span class="cycle">
        ${secs(plan.cycle_s)}
        ${plan.offset_s !== null && html`<small>offset ${secs(plan.offset_s)}</small>`}
      </span>
      <${PlanStrip} stages=${plan.stages} />
      <div class="acts">
        <button
          class="small"
          disabled=${(runs && !next && !edited) || !plan.usable}
          aria-label="Run plan ${plan.plan}"
          onClick=${() => (confirming.value = { plan: plan.plan })}
        >
          Run…
        </button>
        <button class="small" aria-label="${plan.source === "saved" ? "Edit" : "Copy"} plan ${plan.plan}" onClick=${() => edit(plan)}>
          ${plan.source === "saved" ? "Edit" : "Copy"}
        </button>
        ${plan.source === "saved" &&
        html`<button class="small" aria-label="Delete plan ${plan.plan}" onClick=${() => (deleting.value = plan)}>Delete</button>`}
      </div>
    </li>
  `;
}

function Policy({ of: one, now }) {
  const runs = now?.policy === one.policy;
  return html`
    <li data-runs=${runs} data-policy=${one.policy}>
      <div class="what">
        <b>${plain(one.policy)}</b>
        ${runs && html`<span class="badge on">runs</span>`}
        ${now?.pending === one.policy && html`<span class="badge">next</span>`}
        <small>${one.about.replace(`${plain(one.policy)}: `, "")}</small>
      </div>
      <span class="cycle">policy</span>
      <div class="acts">
        <button
          class="small"
          disabled=${runs}
          aria-label="Run policy ${plain(one.policy)}"
          onClick=${() => (confirming.value = { policy: one.policy })}
        >
          Run…
        </button>
      </div>
    </li>
  `;
}

function Run({ junction, wanted }) {
  const close = () => (confirming.value = null);
  const name = wanted.plan ?? wanted.policy;
  const submit = (event) => {
    event.preventDefault();
    const body = { plan: name, by: "dashboard", reason: event.target.elements.reason.value };
    close();
    change("PUT", `/signals/${junction}/plan`, body, (reply) =>
      reply.pending
        ? `${toCome(reply.pending, row()?.mode)}.`
        : `${plain(reply.plan)} is in force.`,
    );
  };
  return html`
    <${Dialog} title="Run ${plain(name)} at ${plain(junction)}?" onClose=${close}>
      <p>
        It runs until further notice, from the next moment at which every published guarantee is kept:
        within two cycles.
      </p>
      <form onSubmit=${submit}>
        <input name="reason" maxlength="500" placeholder="Reason (optional)" aria-label="Reason" />
        <div class="actions">
          <button type="button" onClick=${close}>Cancel</button>
          <button class="primary">Run ${plain(name)}</button>
        </div>
      </form>
    <//>
  `;
}

function Delete({ junction, plan }) {
  const close = () => (deleting.value = null);
  const remove = async () => {
    close();
    const path = `/signals/${junction}/plans/${plan.plan}`;
    const found = await read(path).catch(() => null);
    if (found && found.body.saved_ns !== plan.saved_ns) {
      notify("error", `${found.body.by || "Somebody"} saved plan ${plan.plan} meanwhile: look at it first.`);
    } else {
      const done = () => `Plan ${plan.plan} is deleted.`;
      await change("DELETE", path, undefined, done, { "If-Match": found?.tag ?? "*" });
    }
    readPlans();
  };
  return html`
    <${Dialog} title="Delete plan ${plan.plan}?" onClose=${close}>
      <p>It disappears from the list. Where it runs, it continues until another one is requested.</p>
      <div class="actions">
        <button onClick=${close}>Cancel</button>
        <button class="danger" onClick=${remove}>Delete it</button>
      </div>
    <//>
  `;
}
