/** Changes go through here: REST with an idempotency key, problems as sentences, the API key kept for the tab. */
import { signal } from "@preact/signals";

const KEY = "scm-api-key";

/** Resolver of the open question for an API key; null while nobody asks. */
export const keyWanted = signal(null);

/** Messages for the person at the desk: `{id, kind, text}`. */
export const notices = signal([]);

let nextNotice = 1;

/** @param {"info" | "error"} kind */
export function notify(kind, text) {
  const id = nextNotice++;
  notices.value = [...notices.value, { id, kind, text }];
  setTimeout(() => dismiss(id), kind === "error" ? 9000 : 4000);
}

export function dismiss(id) {
  notices.value = notices.value.filter((notice) => notice.id !== id);
}

/**
 * Ask the city for a change and tell the person how it went.
 * @param {object} extra more headers, as If-Match
 * @returns the reply, or null when it was refused.
 */
export async function change(method, path, body, done, extra = {}) {
  try {
    const reply = await send(method, path, body, crypto.randomUUID?.() ?? String(Math.random()), extra);
    if (done) notify("info", done(reply));
    return reply;
  } catch (error) {
    notify("error", error.message);
    return null;
  }
}

async function send(method, path, body, requestId, extra) {
  const headers = { "Idempotency-Key": requestId, ...extra };
  const key = sessionStorage.getItem(KEY);
  if (key) headers.Authorization = `Bearer ${key}`;
  const isFile = body instanceof Blob;
  if (body !== undefined) headers["Content-Type"] = isFile ? body.type : "application/json";
  const response = await fetch(`/api/v1${path}`, {
    method,
    headers,
    body: body === undefined || isFile ? body : JSON.stringify(body),
  });
  const reply = await response.json().catch(() => ({}));
  if (response.ok) return reply;
  if (response.status === 401 && (await askForKey())) return send(method, path, body, requestId, extra);
  throw new Error(reply.detail || reply.title || `${method} ${path}: ${response.status}`);
}

/**
 * Make sure that this page may read: ask for a key as long as the city wants one.
 * @returns whether it may; false when the person gives none.
 */
export async function enter() {
  while ((await fetch("/api/v1/session")).status === 401) {
    const key = sessionStorage.getItem(KEY);
    if (!key && !(await askForKey())) return false;
    const headers = { Authorization: `Bearer ${sessionStorage.getItem(KEY)}` };
    const reply = await fetch("/api/v1/session", { method: "PUT", headers });
    if (!reply.ok) sessionStorage.removeItem(KEY);
    if (reply.status === 429) await new Promise((resolve) => setTimeout(resolve, 5000));
  }
  return true;
}

async function askForKey() {
  const key = await new Promise((resolve) => (keyWanted.value = resolve));
  keyWanted.value = null;
  if (key) sessionStorage.setItem(KEY, key);
  return Boolean(key);
}
