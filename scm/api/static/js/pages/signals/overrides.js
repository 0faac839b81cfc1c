/** Overrides of groups: calls, holds, force-offs and the like, each with a name, a reason and an end. */
import { signal } from "@preact/signals";
import { html } from "scm/shared/html.js";
import { change, notify } from "scm/shell/api.js";
import { prose } from "scm/shell/prose.js";
import { Dialog } from "scm/shared/dialog.js";
import { clock, newestFirst, span } from "scm/shared/format.js";
import { events } from "scm/shell/store.js";
import { clockNow, row, site, status } from "scm/pages/signals/store.js";
import { plain, toCome, VERBS } from "scm/pages/signals/words.js";

const ROUTES = {
  call: "calls",
  hold: "holds",
  force_off: "force-offs",
  omit: "omits",
  preempt: "preempts",
};

const MEANS = {
  call: "Serve it once; it lapses when its green begins.",
  hold: "Once green, it stays green.",
  force_off: "End its green at its minimum once others are called.",
  omit: "It does not begin.",
  preempt: "It comes next, out of order, and stays green.",
  policy: "Run a policy for a while, then go back.",
};

/** What fixed time cannot grant: the junction runs actuated meanwhile, after the guaranteed times. */
const LEAVES_PLAN = new Set(["hold", "force_off", "omit", "preempt"]);
const WAITS = " The plan first keeps its guaranteed times, up to two cycles; the requested time runs meanwhile.";

const LASTS = [
  [30, "30 s"],
  [60, "1 min"],
  [120, "2 min"],
  [300, "5 min"],
  [900, "15 min"],
];

/** What the form holds now. */
const verb = signal("hold");
const groups = signal([]);
const policy = signal("");
const flashing = signal(false);

/** Fill the form for a group, and move the focus to the reason. */
export function requestFor(what, group) {
  verb.value = what;
  groups.value = [group];
  document.getElementById("override-reason")?.focus();
}

export function Overrides({ current }) {
  const held = status()?.wishes ?? [];
  return html`
    <section class="panel overrides" aria-label="Overrides">
      <div class="panel-head">
        <h2>Overrides <small>the kernel decides when</small></h2>
        <button class="small ${current.mode === "flash" ? "" : "danger"}" onClick=${() => (flashing.value = true)}>
          ${current.mode === "flash" ? "End flash…" : "Flash red…"}
        </button>
      </div>
      <${Form} junction=${current.junction} mode=${current.mode} names=${current.groups.map((one) => one.group)} />
      <${Held} junction=${current.junction} held=${held} />
      <${Lately} junction=${current.junction} />
      ${flashing.value && html`<${Flash} junction=${current.junction} on=${current.mode !== "flash"} />`}
    </section>
  `;
}

function Form({ junction, mode, names }) {
  const isPolicy = verb.value === "policy";
  const policies = (site.value?.policies ?? []).filter((one) => one.policy !== "flashing");
  const flip = (name) => {
    const has = groups.value.includes(name);
    if (verb.value === "preempt") groups.value = has ? [] : [name];
    else groups.value = has ? groups.value.filter((one) => one !== name) : [...groups.value, name];
  };
  const submit = async (event) => {
    event.preventDefault();
    const form = event.target.elements;
    const request = { by: "dashboard", reason: form.reason.value, expires_s: Number(form.lasts.value) };
    if (!isPolicy && !groups.value.length) {
      notify("error", "Choose the groups that it is for.");
      return;
    }
    const what = isPolicy ? policy.value || policies[0]?.policy : groups.value.map(plain).join(", ");
    const reply = isPolicy
      ? await change("PUT", `/signals/${junction}/policy`, { policy: what, ...request }, accepted(what))
      : await change(
          "POST",
          `/signals/${junction}/${ROUTES[verb.value]}`,
          { groups: groups.value, ...request },
          accepted(what),
        );
    if (reply) form.reason.value = "";
  };
  return html`
    <form class="override-form" onSubmit=${submit}>
      <label>
        <span>Override</span>
        <select id="override-verb" value=${verb.value} onChange=${(event) => (verb.value = event.target.value)}>
          ${Object.entries(VERBS).map(([key, word]) => html`<option key=${key} value=${key}>${word}</option>`)}
        </select>
      </label>
      ${isPolicy
        ? html`
            <label>
              <span>Policy</span>
              <select
                id="override-policy"
                value=${policy.value}
                onChange=${(event) => (policy.value = event.target.value)}
              >
                ${policies.map((one) => html`<option key=${one.policy} value=${one.policy}>${plain(one.policy)}</option>`)}
              </select>
            </label>
          `
        : html`
            <fieldset>
              <legend>Groups</legend>
              ${names.map(
                (name) => html`
                  <label key=${name} class="chip">
                    <input
                      type="checkbox"
                      name="group"
                      value=${name}
                      checked=${groups.value.includes(name)}
                      onChange=${() => flip(name)}
                    />${plain(name)}
                  </label>
                `,
              )}
            </fieldset>
          `}
      <label>
        <span>For</span>
        <select name="lasts" aria-label="For how long at most">
          ${LASTS.map(([s, word]) => html`<option key=${s} value=${String(s)} selected=${s === 60}>${word}</option>`)}
        </select>
      </label>
      <label class="why">
        <span>Why</span>
        <input id="override-reason" name="reason" maxlength="500" placeholder="Reason (optional)" />
      </label>
      <button class="primary">Request</button>
      <p class="means">${MEANS[verb.value]}${mode === "plan" && LEAVES_PLAN.has(verb.value) ? WAITS : ""}</p>
    </form>
  `;
}

const accepted = (what) => (reply) =>
  reply.pending
    ? `Accepted: ${what}. ${toCome(reply.pending, row()?.mode)}.`
    : `Accepted: ${what}.`;

function Held({ junction, held }) {
  const t = clockNow();
  const withdraw = (override) =>
    change(
      "POST",
      `/signals/${junction}/clear`,
      { verb: override.verb, groups: override.groups, by: "dashboard", reason: "withdrawn on the dashboard" },
      () => `${VERBS[override.verb]} is withdrawn.`,
    );
  if (!held.length) return html`<p class="empty">No override is in force.</p>`;
  return html`
    <ul class="held">
      ${held.map(
        (override) => html`
          <li key=${override.verb + override.groups.join()} data-verb=${override.verb}>
            <b>${VERBS[override.verb]}</b>
            <span>${override.policy ? plain(override.policy) : override.groups.map(plain).join(", ")}</span>
            <small>${override.by}${override.reason ? `: ${override.reason}` : ""}</small>
            <time>${t === null ? "" : `${span(Math.max(0, override.ends_ns / 1e9 - t))} left`}</time>
            <button class="small" onClick=${() => withdraw(override)}>Withdraw</button>
          </li>
        `,
      )}
    </ul>
  `;
}

const SHOWN = 8;
const SOURCES = new Set(["traffic", "monitor"]);

/** What was requested and what came of it, from the log. */
function Lately({ junction }) {
  const about = new RegExp(`\\b${junction}\\b`);
  const recent = events.value
    .filter((event) => SOURCES.has(event.source) && about.test(event.text))
    .toSorted(newestFirst)
    .slice(0, SHOWN);
  return html`
    <h3>Lately <a href="/events">all events</a></h3>
    <ul class="lately">
      ${recent.map(
        (event) => html`
          <li key=${event.seq} data-severity=${event.severity}>
            <time>${clock(event.t_ns)}</time>
            <span>${prose(event.text.replace(`junction ${junction}`, "").replace(/^:? /, ""))}</span>
          </li>
        `,
      )}
      ${!recent.length && html`<li class="empty">Nothing was requested and nothing changed.</li>`}
    </ul>
  `;
}

function Flash({ junction, on }) {
  const close = () => (flashing.value = false);
  const submit = (event) => {
    event.preventDefault();
    const form = event.target.elements;
    const lasts = Number(form.lasts?.value ?? 0);
    const body = { engaged: on, by: "dashboard", reason: form.reason.value, expires_s: lasts || null };
    close();
    change("PUT", `/signals/${junction}/flash`, body, () =>
      on ? "It flashes red." : "It begins again, all red first.",
    );
  };
  return html`
    <${Dialog} title=${on ? `Flash ${plain(junction)} red?` : `End flash at ${plain(junction)}?`} onClose=${close}>
      <p>
        ${on
          ? "All lights flash red at once: every driver stops, looks, and goes in turn. No time is guaranteed."
          : "All lights go red for the longest clearance, then the plan begins. A fault of the monitor keeps it flashing."}
      </p>
      <form onSubmit=${submit}>
        <input name="reason" maxlength="500" placeholder="Reason (optional)" aria-label="Reason" />
        ${on &&
        html`
          <label class="lasts">
            For
            <select name="lasts" aria-label="For how long">
              <option value="0">until somebody ends it</option>
              ${LASTS.map(([s, word]) => html`<option key=${s} value=${String(s)}>${word}</option>`)}
            </select>
          </label>
        `}
        <div class="actions">
          <button type="button" onClick=${close}>Cancel</button>
          <button class=${on ? "danger" : "primary"}>${on ? "Flash red" : "End flash"}</button>
        </div>
      </form>
    <//>
  `;
}
