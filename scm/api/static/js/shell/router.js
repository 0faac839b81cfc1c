/** Which page is shown: its address, links that change it without a reload, and the browser's back. */
import { computed, signal } from "@preact/signals";
import { placed, unplaced } from "scm/shared/base.js";

const here = signal(unplaced(location.pathname) + location.search);

/** The requested address; its page is drawn after the bar has shown it as current. */
const requested = signal(here.value);

/** Name of the page that the bar points to. */
export const heading = computed(() => pageAt(requested.value));

/** `{page, rest, query}`: `/vehicles/n1?tab=plots` is page `vehicles`, rest `n1`. */
export const route = computed(() => {
  const url = new URL(here.value, location.origin);
  const [, ...rest] = url.pathname.split("/").filter(Boolean);
  return {
    page: pageAt(here.value),
    rest: rest.map(decoded).join("/"),
    query: Object.fromEntries(url.searchParams),
  };
});

/** A part of an address in letters; one that was mistyped stays as it is. */
function decoded(part) {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

/** Show another address; `replace`: without a step for the browser's back. */
export function go(path, { replace = false } = {}) {
  if (path === requested.value) return;
  history[replace ? "replaceState" : "pushState"](null, "", placed(path));
  follow(path);
}

window.addEventListener("popstate", () => follow(unplaced(location.pathname) + location.search));

function pageAt(path) {
  return new URL(path, location.origin).pathname.split("/").filter(Boolean)[0] ?? "map";
}

/** Another page takes a while to draw: first the picture that answers the touch, then it. */
function follow(path) {
  requested.value = path;
  const arrive = () => (here.value = requested.value);
  if (pageAt(path) === pageAt(here.value) || document.hidden) arrive();
  else requestAnimationFrame(() => setTimeout(arrive));
}

document.addEventListener("click", (event) => {
  const link = event.target.closest?.("a[href]");
  const plain = event.button === 0 && !(event.metaKey || event.ctrlKey || event.shiftKey || event.altKey);
  if (!link || !plain || event.defaultPrevented || link.target || link.hasAttribute("download")) return;
  const url = new URL(link.href);
  const path = unplaced(url.pathname);
  if (url.origin !== location.origin || !isPage(path)) return;
  if (url.hash) return; // a place on this page: the browser knows best
  event.preventDefault();
  go(path + url.search);
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
