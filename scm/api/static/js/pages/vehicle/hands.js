/** Hands on the wheel: keys, a gamepad, pads on the screen. Whoever lets go drives no more. */

const KEYS = {
  KeyW: "ahead", ArrowUp: "ahead", KeyS: "back", ArrowDown: "back",
  KeyA: "left", ArrowLeft: "left", KeyD: "right", ArrowRight: "right",
};
const TURN_PER_S = 4;
const RISE_PER_S = 3;
const REST = 0.08; // of a stick: it never comes back to quite nothing
const PULLED = 0.2; // of a trigger
const TRIGGERS = [6, 7];
const TYPED_INTO = "input:not([type=range]), select, textarea, dialog *";

/** Begin to read inputs; `command()` returns the present command, `end()` stops reading. */
export function hands(onLetGo) {
  const held = new Set();
  const command = { held: false, throttle: 0, steering: 0, by: "keys" };
  let last = performance.now();
  const letGo = () => {
    held.clear();
    onLetGo();
  };
  const onDown = (event) => {
    const what = KEYS[event.code];
    // A shortcut keeps to itself that its keys were let go.
    if (event.ctrlKey || event.metaKey || event.altKey) held.size && letGo();
    else if (what && !event.target.closest?.(TYPED_INTO)) {
      event.preventDefault();
      held.add(what);
    }
  };
  const onUp = (event) => {
    if (held.delete(KEYS[event.code]) && !held.size) onLetGo();
  };
  const onFocus = (event) => held.size && event.target.closest?.(TYPED_INTO) && letGo();
  const onMenu = (event) => !event.defaultPrevented && letGo(); // and so does a menu
  const onHidden = () => document.hidden && letGo();
  const listeners = [
    [window, "keydown", onDown],
    [window, "keyup", onUp],
    [window, "blur", letGo],
    [window, "contextmenu", onMenu],
    [document, "focusin", onFocus],
    [document, "visibilitychange", onHidden],
  ];
  for (const [where, name, handle] of listeners) where.addEventListener(name, handle);
  return {
    /** A pad on the screen is pressed, or let go. */
    pad(what, down) {
      if (down) held.add(what);
      else held.delete(what);
      if (!held.size) onLetGo();
    },
    /** What keys and pads are held, by name. */
    held: () => [...held].sort().join(" "),
    command(most) {
      const now = performance.now();
      const passed = Math.min(0.1, (now - last) / 1000);
      last = now;
      if (!document.hasFocus()) held.clear();
      const stick = pull();
      if (stick) Object.assign(command, stick, { throttle: most * stick.throttle });
      else byKeys(command, held, most, passed);
      return command;
    },
    end() {
      held.clear();
      for (const [where, name, handle] of listeners) where.removeEventListener(name, handle);
    },
  };
}

/** Keys: the wheel turns and the pedal goes down in a moment, and comes up at once. */
function byKeys(command, held, most, passed) {
  const way = (held.has("ahead") ? 1 : 0) - (held.has("back") ? 1 : 0);
  const side = (held.has("left") ? 1 : 0) - (held.has("right") ? 1 : 0);
  command.by = "keys";
  command.held = held.size > 0;
  command.steering = towards(command.steering, side, TURN_PER_S * passed);
  const begun = Math.sign(command.throttle) === way ? command.throttle : 0;
  command.throttle = way ? towards(begun, way * most, RISE_PER_S * passed) : 0;
}

/** The state of a gamepad whose trigger is pulled; null: none is. */
function pull() {
  if (document.hidden || !document.hasFocus()) return null;
  for (const pad of navigator.getGamepads?.() ?? []) {
    if (!pad?.connected || !TRIGGERS.some((i) => (pad.buttons[i]?.value ?? 0) > PULLED)) continue;
    const [x, y] = [rested(pad.axes[0]), rested(pad.axes[1])];
    return { by: "gamepad", held: true, throttle: -y, steering: -x };
  }
  return null;
}

function rested(value = 0) {
  return Math.abs(value) < REST ? 0 : Math.max(-1, Math.min(1, value));
}

function towards(from, to, most) {
  return from + Math.max(-most, Math.min(most, to - from));
}
