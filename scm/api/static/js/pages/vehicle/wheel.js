/** Teleoperation of a car: its lease acquired, 25 commands a second, the lease released. */
import { signal } from "@preact/signals";
import { isConnected } from "scm/shell/store.js";
import { hands } from "scm/pages/vehicle/hands.js";
import { BASE } from "scm/shared/base.js";

const PROTOCOL = "scm.drive.v1";
const KEY = "scm-api-key";
const EVERY_MS = 40;
const REPLY_TIMEOUT_MS = 1000;
const GONE_MS = 5000; // the city gives the car back as soon

/**
 * Its state: `state` is `free`, `requesting`, `held` or `over`; `status` is the car's answer to the newest
 * packet, `round_ms` how long that took; `over` is why it ended.
 */
const FREE = { state: "free", vehicle: null, owner: "", status: null, round_ms: null, over: null };
export const wheel = signal(FREE);

const NO_REPLY = { why: "no_reply", throttle: 0, steering: 0 };
const ENDS = {
  closed: "The city does not let this page drive: it needs the key of an operator.",
  unreachable: "The city did not answer.",
  cut: "The connection was lost; the car stops by itself and goes back.",
};

/** The greatest throttle that a key commands. */
export const most = signal(0.4);

/** Which keys and pads are held: `ahead left`. */
export const down = signal("");

/** What drives: `keys`, pads among them, or `gamepad`. */
export const drivenBy = signal("keys");

let socket = null;
let hand = null;
let timer = null;
let seq = 0;
let receivedAt = 0;

/** Acquire a car; with a reason it is taken over from its present owner. */
export function acquire(vehicle, reason = "") {
  drop();
  wheel.value = { ...FREE, state: "requesting", vehicle };
  const key = sessionStorage.getItem(KEY);
  const own = new WebSocket(
    `${location.origin.replace(/^http/, "ws")}${BASE}/api/v1/vehicles/${vehicle}/drive`,
    key ? [PROTOCOL, `scm.key.${key}`] : [PROTOCOL],
  );
  socket = own;
  receivedAt = performance.now();
  timer = setInterval(notice, EVERY_MS);
  own.onopen = () => own.send(JSON.stringify({ type: "take", reason }));
  own.onmessage = (message) => socket === own && receive(JSON.parse(message.data));
  own.onclose = () => socket === own && ended();
}

/** Give the car back to what drove it. */
export function giveBack() {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ type: "give_back" }));
}

/** Let go without a word: the server gives the car back. */
export function drop() {
  const own = socket;
  socket = null;
  own?.close();
  stopHands();
  wheel.value = FREE;
}

/** A pad on the screen. */
export function pad(what, down) {
  hand?.pad(what, down);
}

function receive(word) {
  receivedAt = performance.now();
  if (word.type === "taken") {
    wheel.value = { ...wheel.value, state: "held", owner: word.owner };
    startHands();
  } else if (word.type === "told") {
    const round_ms = word.t_ms === null ? null : performance.now() - word.t_ms;
    wheel.value = { ...wheel.value, status: word, round_ms };
  } else if (word.type === "over") {
    wheel.value = { ...wheel.value, state: "over", over: word };
    stopHands();
  }
}

/** A dead connection reports nothing, so silence is measured. */
function notice() {
  const quiet = performance.now() - receivedAt;
  const { state, status } = wheel.value;
  if (quiet > GONE_MS) {
    socket?.close();
    ended("unreachable");
  } else if (quiet > REPLY_TIMEOUT_MS && state === "held" && status?.why !== "no_reply") {
    wheel.value = { ...wheel.value, status: NO_REPLY, round_ms: null };
  }
}

/** It is over without a word; `why`: as far as that is known. */
function ended(why = isConnected.value ? "closed" : "unreachable") {
  socket = null;
  stopHands();
  const { state } = wheel.value;
  if (state === "over") return;
  const code = state === "held" ? "cut" : why;
  wheel.value = { ...wheel.value, state: "over", over: { code, detail: ENDS[code] } };
}

function startHands() {
  seq = 0;
  hand = hands(send);
  clearInterval(timer);
  timer = setInterval(() => (send(), notice()), EVERY_MS);
}

function stopHands() {
  clearInterval(timer);
  hand?.end();
  hand = null;
  down.value = "";
}

/** Send the present command; a release is sent at once. */
function send() {
  if (socket?.readyState !== WebSocket.OPEN || !hand) return;
  const { held, throttle, steering, by } = hand.command(most.value);
  drivenBy.value = by;
  down.value = hand.held();
  seq += 1;
  socket.send(JSON.stringify({ type: "drive", seq, t_ms: performance.now(), held, throttle, steering }));
}

window.addEventListener("pagehide", drop);
