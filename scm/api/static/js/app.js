/** The dashboard: the shell with its pages, and the store behind them. */
import { render } from "preact";
import { html } from "scm/shared/html.js";
import { PAGES } from "scm/pages/index.js";
import { pagesAre } from "scm/shell/router.js";
import { load, pageHere, Shell } from "scm/shell/shell.js";
import { start } from "scm/shell/store.js";
import "scm/shell/theme.js";

const LONGEST_MS = 500; // without its page the shell comes alone: the red button waits for no slow file

pagesAre(PAGES.map((page) => page.name));
start();
// Until then the frame stands that index.html came with.
await Promise.race([load(pageHere()), new Promise((resolve) => setTimeout(resolve, LONGEST_MS))]);
const root = document.getElementById("app");
root.replaceChildren();
render(html`<${Shell} />`, root);
