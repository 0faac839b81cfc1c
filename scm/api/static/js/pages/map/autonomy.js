/** What cars that park themselves plan, drawn on the map: goal, path, candidates, particles and obstacles. */
import { computed, effect } from "@preact/signals";
import { html } from "scm/shared/html.js";
import { footprint } from "scm/shared/car_shape.js";
import { placed } from "scm/shared/base.js";
import { selected } from "scm/shared/selection.js";
import { topic } from "scm/shell/store.js";
import { carNamed } from "scm/pages/map/fleet.js";
import { layers } from "scm/pages/map/layers.js";

const POLL_MS = 500;
const MOST_SHOWN = 3; // cars whose plans the map shows; of more it shows the chosen car's only
const PATH = "#5ad1ff";
const CANDIDATE = "rgba(255, 255, 255, 0.75)";
const GOAL = "#7dffb0";
const PARTICLE = "#ff7ad9";
const OBSTACLE = "#ffb000";
const RIM = "rgba(8, 12, 18, 0.6)";
const CELL_M = 0.02;
const LEAST_PX = 3;
const TICK_M = 0.03; // of a particle, shows its heading
const HAS_PATH = ["drive", "plan", "recover"];

/** The rows whose plans are shown. */
const shown = computed(() => {
  if (!layers.value.autonomy) return [];
  const rows = (topic("autonomy").value ?? []).filter(({ goal_x_m }) => goal_x_m !== null);
  return rows.length <= MOST_SHOWN ? rows : rows.filter(({ vehicle }) => vehicle === selected.value);
});
const shownNames = computed(() => shown.value.map(({ vehicle }) => vehicle).join());

/** Car to the newest body of `/vehicles/{name}/plan`. */
const plans = new Map();

/** Poll the plans that are shown; returns the function that ends it. */
export function pollPlans() {
  return effect(() => {
    const names = shownNames.value.split(",").filter(Boolean);
    let ended = false;
    const poll = async (name) => {
      const response = await fetch(placed(`/api/v1/vehicles/${name}/plan`)).catch(() => null);
      const plan = response?.ok ? await response.json().catch(() => null) : null;
      if (!ended && plan) plans.set(name, plan);
    };
    names.forEach(poll);
    const timer = setInterval(() => !document.hidden && names.forEach(poll), POLL_MS);
    return () => {
      ended = true;
      clearInterval(timer);
      plans.clear();
    };
  });
}

/** What lies below the cars: goals, paths and what the map has not. */
export function drawPlans(paper, view) {
  for (const row of shown.peek()) {
    const plan = plans.get(row.vehicle);
    const goal = { x: row.goal_x_m, y: row.goal_y_m, yaw: row.goal_yaw_rad };
    drawGoal(paper, view, goal, footprint(carNamed(row.vehicle)?.car ?? "nigel"));
    if (!plan) continue;
    drawObstacles(paper, view, plan.obstacles);
    if (!HAS_PATH.includes(row.state)) continue;
    drawLine(paper, view, plan.path, 2);
    if (row.state !== "drive") continue;
    for (const poses of plan.candidates) drawLine(paper, view, poses, 1.5, CANDIDATE);
    drawLine(paper, view, plan.trajectory, 7, RIM);
    drawLine(paper, view, plan.trajectory, 4);
  }
}

/** What lies above the cars: the poses at which each may be. */
export function drawParticles(paper, view) {
  paper.save();
  paper.fillStyle = paper.strokeStyle = PARTICLE;
  paper.lineWidth = 1;
  for (const { vehicle } of shown.peek()) {
    paper.beginPath();
    for (const [x, y, yaw] of plans.get(vehicle)?.particles ?? []) {
      paper.rect(view.x(x) - 1, view.y(y) - 1, 2, 2);
      paper.moveTo(view.x(x), view.y(y));
      paper.lineTo(view.x(x + TICK_M * Math.cos(yaw)), view.y(y + TICK_M * Math.sin(yaw)));
    }
    paper.fill();
    paper.stroke();
  }
  paper.restore();
}

/** The dashed outline of a parked car, with an arrow ahead. */
export function drawGoal(paper, view, { x, y, yaw }, { rear, front, half }, colour = GOAL) {
  paper.save();
  paper.translate(view.x(x), view.y(y));
  paper.rotate(-yaw);
  paper.scale(view.scale, -view.scale);
  const px = 1 / view.scale;
  const outline = new Path2D();
  outline.roundRect(rear, -half, front - rear, 2 * half, 0.03);
  const arrow = new Path2D();
  arrow.moveTo(front - 0.08, 0.4 * half);
  arrow.lineTo(front - 0.04, 0);
  arrow.lineTo(front - 0.08, -0.4 * half);
  for (const [width, style] of [[4, RIM], [2, colour]]) {
    paper.lineWidth = width * px;
    paper.strokeStyle = style;
    paper.setLineDash([7 * px, 5 * px]);
    paper.stroke(outline);
    paper.setLineDash([]);
    paper.stroke(arrow);
  }
  paper.restore();
}

/** A line through poses, each x, y and more. */
export function drawLine(paper, view, poses, width, colour = PATH) {
  paper.beginPath();
  for (const [x, y] of poses) paper.lineTo(view.x(x), view.y(y));
  paper.lineJoin = paper.lineCap = "round";
  paper.lineWidth = width;
  paper.strokeStyle = colour;
  paper.stroke();
}

function drawObstacles(paper, view, obstacles) {
  const size = Math.max(LEAST_PX, CELL_M * view.scale);
  paper.fillStyle = OBSTACLE;
  for (const [x, y] of obstacles) paper.fillRect(view.x(x) - size / 2, view.y(y) - size / 2, size, size);
}

/** What the signs mean, while there are any. */
export function PlanKey() {
  if (!shownNames.value) return null;
  const signs = { goal: "goal", path: "path", candidate: "compared", particle: "where it may be", obstacle: "not in the map" };
  return html`
    <ul class="legend plan-key" aria-label="Plans of parking cars">
      ${Object.entries(signs).map(([sign, words]) => html`<li key=${sign}><i data-sign=${sign}></i>${words}</li>`)}
    </ul>
  `;
}
