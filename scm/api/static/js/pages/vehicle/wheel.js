/** A connection to a car's wheel: taken, driven 25 times a second, given back. */
import { signal } from "@preact/signals";
import { hands } from "scm/pages/vehicle/hands.js";

const PROTOCOL = "scm.drive.v1";
const KEY = "scm-api-key";
const EVERY_MS = 40;

/**
 * How it stands: `state` is `free`, `asking`, `held` or `over`; `told` is the car's answer to the newest
 * packet, `round_ms` how long that took; `over` says why it ended.
 */
const FREE = { state: "free", vehicle: null, owner: "", told: null, round_ms: null, over: null };
export const wheel = signal(FREE);

/** The greatest throttle that a key asks for. */
export const most = signal(0.4);

/** Which keys and pads are held: `ahead left`. */
export const down = signal("");

let socket = null;
let hand = null;
let timer = null;
let seq = 0;

/** Ask for a car; with a reason it is taken from whoever has it. */
export function take(vehicle, reason = "") {
  drop();
  wheel.value = { ...FREE, state: "asking", vehicle };
  const key = sessionStorage.getItem(KEY);
  const own = new WebSocket(
    `${location.origin.replace(/^http/, "ws")}/api/v1/vehicles/${vehicle}/drive`,
    key ? [PROTOCOL, `scm.key.${key}`] : [PROTOCOL],
  );
  socket = own;
  own.onopen = () => own.send(JSON.stringify({ type: "take", reason }));
  own.onmessage = (message) => socket === own && hear(JSON.parse(message.data));
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

function hear(word) {
  if (word.type === "taken") {
    wheel.value = { ...wheel.value, state: "held", owner: word.owner };
    startHands();
  } else if (word.type === "told") {
    const round_ms = word.t_ms === null ? null : performance.now() - word.t_ms;
    wheel.value = { ...wheel.value, told: word, round_ms };
  } else if (word.type === "over") {
    wheel.value = { ...wheel.value, state: "over", over: word };
    stopHands();
  }
}

function ended() {
  socket = null;
  stopHands();
  if (wheel.value.state === "over") return;
  const asked = wheel.value.state === "asking";
  const detail = asked
    ? "The city does not let this page drive: it needs the key of an operator."
    : "The connection was lost; the car stops by itself and goes back.";
  wheel.value = { ...wheel.value, state: "over", over: { code: asked ? "closed" : "cut", detail } };
}

function startHands() {
  seq = 0;
  hand = hands(send);
  timer = setInterval(send, EVERY_MS);
}

function stopHands() {
  clearInterval(timer);
  hand?.end();
  hand = null;
  down.value = "";
}

/** Say what is wished for now; who lets go says so at once. */
function send() {
  if (socket?.readyState !== WebSocket.OPEN || !hand) return;
  const { held, throttle, steering } = hand.wish(most.value);
  down.value = hand.held();
  seq += 1;
  socket.send(JSON.stringify({ type: "drive", seq, t_ms: performance.now(), held, throttle, steering }));
}

window.addEventListener("pagehide", drop);
