/** Which page is shown: its address, links that change it without a reload, and the browser's back. */
import { computed, signal } from "@preact/signals";

const here = signal(location.pathname + location.search);

/** `{page, rest, query}`: `/vehicles/n1?tab=plots` is page `vehicles`, rest `n1`. */
export const route = computed(() => {
  const url = new URL(here.value, location.origin);
  const [page, ...rest] = url.pathname.split("/").filter(Boolean);
  return {
    page: page ?? "map",
    rest: rest.map(decodeURIComponent).join("/"),
    query: Object.fromEntries(url.searchParams),
  };
});

/** Show another address; `replace`: without a step for the browser's back. */
export function go(path, { replace = false } = {}) {
  if (path === here.value) return;
  history[replace ? "replaceState" : "pushState"](null, "", path);
  here.value = path;
}

window.addEventListener("popstate", () => (here.value = location.pathname + location.search));

document.addEventListener("click", (event) => {
  const link = event.target.closest?.("a[href]");
  const plain = event.button === 0 && !(event.metaKey || event.ctrlKey || event.shiftKey || event.altKey);
  if (!link || !plain || event.defaultPrevented || link.target || link.hasAttribute("download")) return;
  const url = new URL(link.href);
  if (url.origin !== location.origin || !isPage(url.pathname)) return;
  if (url.hash) return; // a place on this page: the browser knows best
  event.preventDefault();
  go(url.pathname + url.search);
});

let names = new Set();

/** Tell which first parts of an address are pages of the dashboard; all others are the server's. */
export function pagesAre(list) {
  names = new Set(list);
}

function isPage(path) {
  const first = path.split("/")[1];
  return first === "" || names.has(first);
}
