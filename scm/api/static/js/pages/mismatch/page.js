/** The mismatch page: `/mismatch` lists reports and searches, `/mismatch/NAME` shows one report. */
import { html } from "scm/shared/html.js";
import { route } from "scm/shell/router.js";
import { List } from "scm/pages/mismatch/list.js";
import { Report } from "scm/pages/mismatch/report.js";

export function Page() {
  const name = route.value.rest;
  return name ? html`<${Report} key=${name} name=${name} />` : html`<${List} />`;
}
