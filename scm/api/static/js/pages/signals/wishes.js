/** Wishes for groups: calls, holds, force-offs and the like, each with who, why and an end. */
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
  force_off: "End its green at its least time once others are called.",
  omit: "It is not begun.",
  preempt: "It comes next, out of order, and stays.",
  policy: "Run a policy for a while, then go back.",
};

/** What fixed time cannot grant: the junction runs actuated meanwhile, after what it has promised. */
const LEAVES_PLAN = new Set(["hold", "force_off", "omit", "preempt"]);
const WAITS = " The plan first keeps what it promised, up to two cycles; the time asked for runs meanwhile.";

const LASTS = [
  [30, "30 s"],
  [60, "1 min"],
  [120, "2 min"],
  [300, "5 min"],
  [900, "15 min"],
];

/** What the form says now. */
const verb = signal("hold");
const groups = signal([]);
const policy = signal("");
const flashing = signal(false);

/** Fill the form for a group, and let the person say why. */
export function wishFor(what, group) {
  verb.value = what;
  groups.value = [group];
  document.getElementById("wish-reason")?.focus();
}

export function Wishes({ told }) {
  const held = status()?.wishes ?? [];
  return html`
    <section class="panel wishes" aria-label="Wishes">
      <div class="panel-head">
        <h2>Wishes <small>the kernel decides when</small></h2>
        <button class="small ${told.mode === "flash" ? "" : "danger"}" onClick=${() => (flashing.value = true)}>
          ${told.mode === "flash" ? "End flash…" : "Flash red…"}
        </button>
      </div>
      <${Form} junction=${told.junction} mode=${told.mode} names=${told.groups.map((one) => one.group)} />
      <${Held} junction=${told.junction} held=${held} />
      <${Lately} junction=${told.junction} />
      ${flashing.value && html`<${Flash} junction=${told.junction} on=${told.mode !== "flash"} />`}
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
    const asked = { by: "dashboard", reason: form.reason.value, expires_s: Number(form.lasts.value) };
    if (!isPolicy && !groups.value.length) {
      notify("error", "Choose the groups that it is for.");
      return;
    }
    const what = isPolicy ? policy.value || policies[0]?.policy : groups.value.map(plain).join(", ");
    const reply = isPolicy
      ? await change("PUT", `/signals/${junction}/policy`, { policy: what, ...asked }, taken(what))
      : await change(
          "POST",
          `/signals/${junction}/${ROUTES[verb.value]}`,
          { groups: groups.value, ...asked },
          taken(what),
        );
    if (reply) form.reason.value = "";
  };
  return html`
    <form class="wish" onSubmit=${submit}>
      <label>
        <span>Wish</span>
        <select id="wish-verb" value=${verb.value} onChange=${(event) => (verb.value = event.target.value)}>
          ${Object.entries(VERBS).map(([key, word]) => html`<option key=${key} value=${key}>${word}</option>`)}
        </select>
      </label>
      ${isPolicy
        ? html`
            <label>
              <span>Policy</span>
              <select
                id="wish-policy"
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
        <input id="wish-reason" name="reason" maxlength="500" placeholder="Reason (optional)" />
      </label>
      <button class="primary">Ask</button>
      <p class="means">${MEANS[verb.value]}${mode === "plan" && LEAVES_PLAN.has(verb.value) ? WAITS : ""}</p>
    </form>
  `;
}

const taken = (what) => (reply) =>
  reply.pending
    ? `Taken: ${what}. ${toCome(reply.pending, row()?.mode)}.`
    : `Taken: ${what}.`;

function Held({ junction, held }) {
  const t = clockNow();
  const takeBack = (wish) =>
    change(
      "POST",
      `/signals/${junction}/clear`,
      { verb: wish.verb, groups: wish.groups, by: "dashboard", reason: "taken back on the dashboard" },
      () => `${VERBS[wish.verb]} is taken back.`,
    );
  if (!held.length) return html`<p class="empty">No wish is in force.</p>`;
  return html`
    <ul class="held">
      ${held.map(
        (wish) => html`
          <li key=${wish.verb + wish.groups.join()} data-verb=${wish.verb}>
            <b>${VERBS[wish.verb]}</b>
            <span>${wish.policy ? plain(wish.policy) : wish.groups.map(plain).join(", ")}</span>
            <small>${wish.by}${wish.reason ? `: ${wish.reason}` : ""}</small>
            <time>${t === null ? "" : `${span(Math.max(0, wish.ends_ns / 1e9 - t))} left`}</time>
            <button class="small" onClick=${() => takeBack(wish)}>Take back</button>
          </li>
        `,
      )}
    </ul>
  `;
}

const SHOWN = 8;
const SAYING = new Set(["traffic", "monitor"]);

/** What was asked for and what came of it, from the log. */
function Lately({ junction }) {
  const about = new RegExp(`\\b${junction}\\b`);
  const told = events.value
    .filter((event) => SAYING.has(event.source) && about.test(event.text))
    .toSorted(newestFirst)
    .slice(0, SHOWN);
  return html`
    <h3>Lately <a href="/events">all events</a></h3>
    <ul class="lately">
      ${told.map(
        (event) => html`
          <li key=${event.seq} data-severity=${event.severity}>
            <time>${clock(event.t_ns)}</time>
            <span>${prose(event.text.replace(`junction ${junction}`, "").replace(/^:? /, ""))}</span>
          </li>
        `,
      )}
      ${!told.length && html`<li class="empty">Nothing was asked for and nothing changed.</li>`}
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
          ? "All lights flash red at once: every driver stops, looks, and goes in turn. No promise holds."
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
