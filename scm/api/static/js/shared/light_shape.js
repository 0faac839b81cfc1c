/** A signal head's live colour and letter, over the head that the map shows. */

const COLOURS = {
  red: "#ff5a55",
  yellow: "#ffc14d",
  green: "#35d08d",
  flashing_red: "#ff5a55",
  dark: "#4a525c",
};
const LETTERS = { red: "R", yellow: "Y", green: "G", flashing_red: "F", dark: "D" };
const FLASH_MS = 500;

export function drawLight(paper, view, light, colour) {
  const [x, y] = [view.x(light.x_m), view.y(light.y_m)];
  const radius = Math.max(8, Math.min(13, 0.035 * view.scale));
  paper.beginPath();
  paper.arc(x, y, radius + 2.5, 0, 2 * Math.PI);
  paper.fillStyle = "#10151b";
  paper.fill();
  const off = colour === "flashing_red" && Math.floor(performance.now() / FLASH_MS) % 2;
  if (colour && colour !== "dark" && !off) glow(paper, x, y, radius, COLOURS[colour]);
  paper.beginPath();
  paper.arc(x, y, radius, 0, 2 * Math.PI);
  paper.fillStyle = off ? "#5a2523" : (COLOURS[colour] ?? "#4a525c");
  paper.fill();
  paper.fillStyle = off || !colour || colour === "dark" ? "#e6e9ee" : "#0b0f13";
  paper.font = `700 ${Math.round(1.15 * radius)}px system-ui, sans-serif`;
  paper.textAlign = "center";
  paper.textBaseline = "middle";
  paper.fillText(LETTERS[colour] ?? "?", x, y + 0.5);
}

function glow(paper, x, y, radius, colour) {
  const light = paper.createRadialGradient(x, y, radius, x, y, 2.4 * radius);
  light.addColorStop(0, `${colour}66`);
  light.addColorStop(1, `${colour}00`);
  paper.beginPath();
  paper.arc(x, y, 2.4 * radius, 0, 2 * Math.PI);
  paper.fillStyle = light;
  paper.fill();
}
