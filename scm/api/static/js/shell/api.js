/** Changes go through here: REST with an idempotency key, problems as sentences, the API key stored for the tab. */
import { signal } from "@preact/signals";
import { placed } from "scm/shared/base.js";
import { unreached } from "scm/shared/fetched.js";

const KEY = "scm-api-key";
const REFUSALS = [401, 403, 429]; // of a key; what else goes wrong is not its fault

/** Resolver of the open request for an API key; null: none is open. */
export const keyWanted = signal(null);

/** Messages for the user: `{id, kind, text}`. */
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
 * Request a change from the city and show the user the result.
 * @param headers more of them, such as `If-Match`.
 * @param timeout_ms how long to wait for the answer; none: no limit.
 * @param refused receives the sentence of a refusal instead of a notice, by the problem's code.
 * @returns the reply, or null when it was refused.
 */
export async function change(method, path, body, done, headers = {}, timeout_ms = null, refused = {}) {
  try {
    const id = crypto.randomUUID?.() ?? String(Math.random());
    const reply = await send(method, path, body, { ...headers, "Idempotency-Key": id }, timeout_ms);
    if (done) notify("info", done(reply));
    return reply;
  } catch (error) {
    if (refused[error.code]) refused[error.code](error.message);
    else notify("error", error.message);
    return null;
  }
}

async function send(method, path, body, own, timeout_ms) {
  const headers = { ...own };
  const key = sessionStorage.getItem(KEY);
  if (key) headers.Authorization = `Bearer ${key}`;
  const isFile = body instanceof Blob;
  if (body !== undefined) headers["Content-Type"] = isFile ? body.type : "application/json";
  const response = await fetch(placed(`/api/v1${path}`), {
    method,
    headers,
    body: body === undefined || isFile ? body : JSON.stringify(body),
    signal: timeout_ms && AbortSignal.timeout(timeout_ms),
  }).catch(unreached);
  const reply = await response.json().catch(() => ({}));
  if (response.ok) return reply;
  if (response.status === 401 && (await requestKey())) return send(method, path, body, own, timeout_ms);
  const sentence = reply.detail || reply.title || `${method} ${path}: ${response.status}`;
  throw Object.assign(new Error(sentence), { code: reply.code });
}

/**
 * Make sure that this page may read: request a key as long as the city requires one.
 * @returns whether it may; false when the user gave none; the next change asks again.
 */
export function enter() {
  entering ??= knock().finally(() => (entering = null));
  return entering;
}

/** Whoever finds the door closed waits for the one answer: every stream does when a key ends. */
let entering = null;

async function knock() {
  while ((await fetch(placed("/api/v1/session"))).status === 401) {
    const key = sessionStorage.getItem(KEY);
    if (!key && (declined || !(await requestKey()))) return false;
    const headers = { Authorization: `Bearer ${sessionStorage.getItem(KEY)}` };
    const reply = await fetch(placed("/api/v1/session"), { method: "PUT", headers });
    if (REFUSALS.includes(reply.status)) {
      sessionStorage.removeItem(KEY);
      notify("error", "The city does not accept this key.");
    }
    if (!reply.ok && reply.status !== 401) await new Promise((resolve) => setTimeout(resolve, 5000));
  }
  return true;
}

let keyRequest = null;
let declined = false;

function requestKey() {
  keyRequest ??= new Promise((resolve) => (keyWanted.value = resolve)).then((key) => {
    keyRequest = keyWanted.value = null;
    if (key) sessionStorage.setItem(KEY, key);
    declined = !key;
    return Boolean(key);
  });
  return keyRequest;
}
