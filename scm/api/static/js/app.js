/** The dashboard: the shell with its pages, and the store behind them. */
import { render } from "preact";
import { html } from "scm/shared/html.js";
import { PAGES } from "scm/pages/index.js";
import { pagesAre } from "scm/shell/router.js";
import { Shell } from "scm/shell/shell.js";
import { start } from "scm/shell/store.js";
import "scm/shell/theme.js";

pagesAre(PAGES.map((page) => page.name));
const root = document.getElementById("app");
root.replaceChildren();
render(html`<${Shell} />`, root);
start();
