/** Sentences with commands in them. */
import { html } from "scm/shared/html.js";

/** @param {string} text what stands in it between backquotes is a command, and set as one */
export const coded = (text) => text.split("`").map((part, i) => (i % 2 ? html`<code>${part}</code>` : part));
