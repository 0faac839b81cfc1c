/**
 * A signal head's live colour over the head that the map shows: by colour, shape and letter alike.
 *
 * Red is a square, yellow a diamond, green a circle; flashing red is a square that comes and goes.
 */

const COLOURS = {
  red: "#ff5a55",
  yellow: "#ffc14d",
  green: "#35d08d",
  flashing_red: "#ff5a55",
  dark: "#4a525c",
};
export const LETTERS = { red: "R", yellow: "Y", green: "G", flashing_red: "F", dark: "D" };
const FLASH_MS = 500;
const LEAST_PX = 3.5;
const MOST_PX = 13;
const SIZE_M = 0.05;
const LETTER_PX = 6.5; // smaller ones would be a blur
const TIME_PX = 8;
const TIME_ROOM_PX = 10; // from the lamp to the middle of the time below it
const TIME_HALF_PX = 18;

/** What a head covers on the canvas, with the time beside it: left, top, right, bottom. */
export function coveredBy(view, light, isTimed) {
  const [x, y] = [view.x(light.x_m), view.y(light.y_m)];
  const size = sizeOf(view);
  const reach = 1.32 * size;
  const hasTime = isTimed && size >= TIME_PX;
  const wide = hasTime ? Math.max(reach, TIME_HALF_PX) : reach;
  return [x - wide, y - reach, x + wide, y + reach + (hasTime ? 2 * TIME_ROOM_PX : 0)];
}

const sizeOf = (view) => Math.max(LEAST_PX, Math.min(MOST_PX, SIZE_M * view.scale));

/** Draw a head; `time` is what to write beside it, or nothing. */
export function drawLight(paper, view, light, colour, time = "") {
  const [x, y] = [view.x(light.x_m), view.y(light.y_m)];
  const size = sizeOf(view);
  const off = colour === "flashing_red" && Math.floor(performance.now() / FLASH_MS) % 2;
  const lit = colour && colour !== "dark" && !off;
  paper.beginPath();
  paper.arc(x, y, 1.32 * size, 0, 2 * Math.PI);
  paper.fillStyle = "#10151b";
  paper.fill();
  if (lit && size >= LETTER_PX) glow(paper, x, y, size, COLOURS[colour]);
  paper.beginPath();
  outline(paper, colour, x, y, size);
  paper.fillStyle = off ? "#5a2523" : (COLOURS[colour] ?? "#4a525c");
  paper.fill();
  if (size >= LETTER_PX) {
    paper.fillStyle = lit ? "#0b0f13" : "#e6e9ee";
    paper.font = `700 ${Math.round(1.15 * size)}px system-ui, sans-serif`;
    paper.textAlign = "center";
    paper.textBaseline = "middle";
    paper.fillText(LETTERS[colour] ?? "?", x, y + 0.5);
  }
  if (time && size >= TIME_PX) label(paper, x, y + 1.32 * size + TIME_ROOM_PX, time);
}

function outline(paper, colour, x, y, size) {
  if (colour === "red" || colour === "flashing_red") {
    const side = 0.86 * size;
    paper.roundRect(x - side, y - side, 2 * side, 2 * side, 0.2 * size);
  } else if (colour === "yellow") {
    const reach = 1.14 * size;
    paper.moveTo(x + reach, y);
    paper.lineTo(x, y + reach);
    paper.lineTo(x - reach, y);
    paper.lineTo(x, y - reach);
    paper.closePath();
  } else paper.arc(x, y, size, 0, 2 * Math.PI);
}

function label(paper, x, y, text) {
  paper.font = "600 11px system-ui, sans-serif";
  paper.textAlign = "center";
  paper.textBaseline = "middle";
  const width = paper.measureText(text).width + 10;
  paper.beginPath();
  paper.roundRect(x - width / 2, y - 8, width, 16, 5);
  paper.fillStyle = "rgba(13, 18, 24, 0.86)";
  paper.fill();
  paper.fillStyle = "#f1f4f8";
  paper.fillText(text, x, y + 0.5);
}

function glow(paper, x, y, radius, colour) {
  const light = paper.createRadialGradient(x, y, radius, x, y, 2.2 * radius);
  light.addColorStop(0, `${colour}55`);
  light.addColorStop(1, `${colour}00`);
  paper.beginPath();
  paper.arc(x, y, 2.2 * radius, 0, 2 * Math.PI);
  paper.fillStyle = light;
  paper.fill();
}
