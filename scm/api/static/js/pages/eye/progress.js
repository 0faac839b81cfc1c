/** What steps of the wizard share: names for what they keep, and how far long work is. */
import { html } from "scm/shared/html.js";

/** A name that is free: `overhead-lens`, then `overhead-lens-2`. */
export function freeName(base, kept) {
  const taken = new Set(kept.map((one) => one.name));
  let name = base;
  for (let i = 2; taken.has(name); i++) name = `${base}-${i}`;
  return name;
}

/** What an operation is at, and how it ended. */
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
