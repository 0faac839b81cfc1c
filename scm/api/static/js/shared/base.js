/** Where the dashboard stands below its host: empty, or `/city` behind a proxy that gives it that path. */
export const BASE = document.documentElement.dataset.base ?? "";

/** An address of ours as the browser has to request it; one that has the base already is returned unchanged. */
export function placed(address) {
  return address.startsWith("/") && !(BASE && address.startsWith(`${BASE}/`)) ? BASE + address : address;
}

/** A path as the dashboard knows it, without the base. */
export function unplaced(path) {
  if (!BASE || !(path === BASE || path.startsWith(`${BASE}/`))) return path;
  return path.slice(BASE.length) || "/";
}
