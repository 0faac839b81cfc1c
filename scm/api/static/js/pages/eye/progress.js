/** What steps of the wizard share: names of what they save, and the progress of long work. */
import { useEffect, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";

/** A name that is free: `overhead-lens`, then `overhead-lens-2`. */
export function freeName(base, saved) {
  const names = new Set(saved.map((one) => one.name));
  let name = base;
  for (let i = 2; names.has(name); i++) name = `${base}-${i}`;
  return name;
}

/** State that survives a reload of the page, in this window: what somebody measured and typed. */
export function useStored(name, first) {
  const [value, set] = useState(() => JSON.parse(sessionStorage.getItem(name)) ?? first);
  useEffect(() => sessionStorage.setItem(name, JSON.stringify(value)), [name, value]);
  return [value, set];
}

/** Whether all fields of a step hold numbers; the browser points to the first that does not. */
export function filledIn(step) {
  return [...step.querySelectorAll("input[type=number]")].every((field) => field.reportValidity());
}

/** The step of an operation, and how it ended. */
export function Progress({ row, cancel }) {
  if (row === null || row.state === "done") return null;
  if (row.state === "failed") return html`<p class="failed" role="alert">${row.error}</p>`;
  if (row.state === "cancelled") return html`<p class="note" role="status">Called off.</p>`;
  return html`
    <p class="running" role="status">
      <progress></progress><span>${row.doing}</span>
      <button class="small" onClick=${cancel}>Call off</button>
    </p>
  `;
}
