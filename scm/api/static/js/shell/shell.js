/** The frame of every page: title bar, banners, the page itself, notices. */
import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { placed } from "scm/shared/base.js";
import { html } from "scm/shared/html.js";
import { PAGES } from "scm/pages/index.js";
import { KeyDialog } from "scm/shell/key_dialog.js";
import { Notices } from "scm/shell/notices.js";
import { heading, route } from "scm/shell/router.js";
import { Banners, TitleBar } from "scm/shell/title_bar.js";
import { city, link, windowTitle } from "scm/shell/store.js";

/** Pages that were loaded: name to component, or to the error that kept it from loading. */
const loaded = signal(new Map());

/** A page by its name; undefined: there is none. */
const pageOf = (name) => PAGES.find((one) => one.name === name);

/** The page of the address; undefined: there is none. */
export const pageHere = () => pageOf(route.value.page);

/** Load a page, once; one that cannot be loaded shows the error in its place. */
export async function load(page) {
  if (!page || loaded.value.has(page.name)) return;
  let found;
  try {
    const [module] = await Promise.all([page.load(), style(page.name)]);
    found = module.Page;
  } catch (error) {
    found = error;
  }
  loaded.value = new Map(loaded.value).set(page.name, found);
}

/** A page's style sheet, before the page is drawn; the first page's came with the document. */
function style(name) {
  const href = placed(`/static/css/pages/${name}.css`);
  if (document.querySelector(`link[href="${href}"]`)?.sheet) return undefined;
  return new Promise((resolve, reject) => {
    const sheet = document.createElement("link");
    sheet.rel = "stylesheet";
    sheet.href = href;
    sheet.onload = resolve;
    sheet.onerror = () => reject(new Error(`its style sheet ${sheet.href} did not load`));
    document.head.append(sheet);
  });
}

export function Shell() {
  const page = pageHere();
  const main = useRef(null);
  const first = useRef(true);
  const next = pageOf(heading.value);
  useEffect(() => void load(next), [next]);
  const usual = [page?.title, city.value?.title ?? "Smart City Manager"].filter(Boolean).join(" · ");
  const title = windowTitle.value || usual;
  useEffect(() => void (document.title = title), [title]);
  useEffect(() => {
    // A new page begins at its top, also for who listens to it; the first one takes nobody's focus.
    if (!first.current) main.current?.focus();
    first.current = false;
  }, [page]);
  return html`
    <div class="page" data-link=${link.value}>
      <a class="skip" href="#main">Skip to the page</a>
      <${TitleBar} pages=${PAGES} here=${next?.under ?? next?.name} />
      <${Banners} />
      <main id="main" class="at-${page?.name ?? "nowhere"}" tabindex="-1" ref=${main}>
        <${Body} page=${page} />
      </main>
      <${Notices} />
      <${KeyDialog} />
    </div>
  `;
}

function Body({ page }) {
  if (!page) {
    return html`<p class="empty">There is no such page. <a href="/map">Go to the map</a>.</p>`;
  }
  const found = loaded.value.get(page.name);
  if (!found) return null;
  if (found instanceof Error) {
    const again = () => location.reload();
    return html`
      <section class="panel" role="alert">
        <h2>The page could not be loaded</h2>
        <p>${found.message}</p>
        <div class="actions"><button onClick=${again}>Load again</button></div>
      </section>
    `;
  }
  return html`<${found} key=${page.name} />`;
}
