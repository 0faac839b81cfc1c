/** Step 1: pictures of a printed board, where in the frame it was seen, and the lens they determine. */
import { useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { fixed } from "scm/shared/format.js";
import { Sure } from "scm/shared/sure.js";
import { savedBy, useUnfinished } from "scm/pages/eye/unfinished.js";
import { readBody, useFetched } from "scm/shared/fetched.js";
import { finished } from "scm/shared/operation.js";
import { Coverage } from "scm/pages/eye/coverage.js";
import { filledIn, freeName, Progress, useStored } from "scm/pages/eye/progress.js";
import { change, notify } from "scm/shell/api.js";

const WANTED = 15;
const BLURRED = 0.4; // of the median sharpness of the set
const BOARDS = { chessboard: "Chessboard", charuco: "ChArUco", tags: "Grid of tags" };

const FIRST = { board: "chessboard", columns: 9, rows: 6, square_mm: 30, marker_mm: 22, first_id: 0, fisheye: false };

export function LensStep({ camera, saved, done, put }) {
  const root = `/eye/cameras/${camera.camera}`;
  const { body, error, again } = useFetched(`${root}/views`, 0);
  const [board, setBoard] = useStored(`board ${camera.camera}`, FIRST);
  const [row, setRow] = useState(null);
  const [lens, setLens] = useState(null);
  const [sure, setSure] = useState(false);
  const step = useRef(null);
  const busy = row !== null && ["waiting", "running"].includes(row.state);
  const name = freeName(`${camera.camera}-lens`, saved);

  const follow = async (operation) => {
    const over = await finished(operation, setRow);
    again();
    const called = savedBy(over);
    if (!called) return;
    const report = await readBody(`/eye/calibrations/${called}/report`).catch(() => null);
    setLens(report && { ...report.lens, called });
    notify("info", `The lens is saved as ${called}.`);
    done();
  };
  useUnfinished([`lens of ${camera.camera}`, `board in pictures of ${camera.camera}`], follow);
  const run = async (save_as) => {
    if (!filledIn(step.current)) return;
    const operation = await change("POST", `${root}/lens`, { ...bodyOf(board), save_as });
    if (operation) await follow(operation);
  };
  const add = async (files) => {
    for (const file of files) if (!(await change("POST", `${root}/views`, file))) break;
    await run(null);
  };
  const throwAway = async () => (await change("DELETE", `${root}/views`, undefined, () => "All pictures are gone.")) && again();
  const views = body?.views ?? [];
  return html`
    <section ref=${step} class="panel eye-lens" aria-label="Lens">
      <div class="panel-head">
        <h2><b class="step">1</b> Lens <small>by a printed board</small></h2>
        <span class="facts">${views.length ? `${views.filter((one) => one.found).length} of ${views.length} pictures show the board` : "no pictures yet"}</span>
      </div>
      <p class="note">
        Hold the board still in every part of the frame, near and far, leaning 30 to 45° to different sides. Take 15 to 25
        pictures. A simulated camera sees no board: add files instead.
      </p>
      <${BoardForm} board=${board} set=${setBoard} />
      <div class="row">
        <button disabled=${busy} onClick=${() => add([undefined])}>Take a picture</button>
        <${Files} disabled=${busy} add=${add} />
        <button disabled=${busy || !views.length} onClick=${() => run(null)}>Look again</button>
        <button class="plain" disabled=${busy || !views.length} onClick=${() => setSure(true)}>Throw all away</button>
      </div>
      ${sure &&
      html`
        <${Sure} title="Throw all pictures away?" yes="Throw away" act=${throwAway} onClose=${() => setSure(false)}>
          ${`All ${views.length} pictures from ${camera.camera} are deleted for everybody. Calibrations computed from them remain.`}
        <//>
      `}
      ${error && html`<p class="failed" role="alert">${error}</p>`}
      <${Progress} row=${row} cancel=${() => change("DELETE", `/operations/${row.id}`)} />
      ${views.length > 0 &&
      html`
        <div class="lens-work">
          <${Coverage} camera=${camera} views=${views} findings=${body.findings} />
          <${ViewList} views=${views} root=${root} again=${again} />
        </div>
        <${Advice} views=${views} findings=${body.findings} />
        <div class="row">
          <button class="primary" disabled=${busy || !views.some((one) => one.found)} onClick=${() => run(name)}>
            Measure the lens
          </button>
          <small>${`will be saved as ${name}`}</small>
        </div>
      `}
      ${lens?.numbers && html`<${Lens} lens=${lens} put=${put} />`}
    </section>
  `;
}

/** The body of the request; fields hold what was typed. */
function bodyOf({ board, columns, rows, square_mm, marker_mm, first_id, fisheye }) {
  return {
    board,
    columns: Number(columns),
    rows: Number(rows),
    square_m: Number(square_mm) / 1000,
    marker_m: board === "chessboard" ? null : Number(marker_mm) / 1000,
    first_id: board === "tags" ? Number(first_id) : 0,
    fisheye,
  };
}

/** The board as the server prints it. */
const asQuery = ({ board, columns, rows, square_mm, marker_mm, first_id }) =>
  new URLSearchParams({ board, columns, rows, square_mm, marker_mm, first_id });

function BoardForm({ board, set }) {
  const number = (name, title, step = 1) => html`
    <label>${title}
      <input
        type="number"
        name=${name}
        min="0"
        step=${step}
        required
        value=${board[name]}
        onInput=${(event) => set({ ...board, [name]: event.currentTarget.value })}
      />
    </label>
  `;
  return html`
    <div class="fields">
      <label>Board
        <select name="board" value=${board.board} onChange=${(event) => set({ ...board, board: event.currentTarget.value })}>
          ${Object.entries(BOARDS).map(([value, title]) => html`<option key=${value} value=${value}>${title}</option>`)}
        </select>
      </label>
      ${number("columns", board.board === "tags" ? "Tags across" : "Squares across")}
      ${number("rows", "down")}
      ${number("square_mm", board.board === "tags" ? "Middle to middle [mm]" : "Square [mm]", "any")}
      ${board.board !== "chessboard" && number("marker_mm", "Marker [mm]", "any")}
      ${board.board === "tags" && number("first_id", "First id")}
      <label class="check">
        <input type="checkbox" checked=${board.fisheye} onChange=${(event) => set({ ...board, fisheye: event.currentTarget.checked })} />
        wider than 100°
      </label>
      <a href=${`/api/v1/eye/print/board.pdf?${asQuery(board)}`} target="_blank" title="PDF at true size, with a ruler">Print this board</a>
    </div>
  `;
}

function Files({ disabled, add }) {
  const input = useRef(null);
  return html`
    <button disabled=${disabled} onClick=${() => input.current.click()}>Add files …</button>
    <input
      ref=${input}
      class="hidden"
      type="file"
      multiple
      tabindex="-1"
      aria-label="Pictures of the board"
      accept="image/jpeg,image/png"
      onChange=${(event) => {
        const files = [...event.currentTarget.files];
        event.currentTarget.value = "";
        if (files.length) add(files);
      }}
    />
  `;
}

function ViewList({ views, root, again }) {
  const found = views.filter((one) => one.found?.sharpness).map((one) => one.found.sharpness).toSorted((a, b) => a - b);
  const typical = found[Math.floor(found.length / 2)];
  return html`
    <ul class="views" aria-label="Pictures of the board">
      ${views.map((view) => html`
        <li key=${view.name} class=${view.found ? "" : "warn"}>
          <img src=${`/api/v1${root}/views/${view.name}`} alt="" loading="lazy" />
          <span><b>${view.name.slice(0, 4)}</b> ${textOf(view, typical)}</span>
          <button
            class="plain"
            aria-label="Throw picture ${view.name} away"
            onClick=${async () => (await change("DELETE", `${root}/views/${view.name}`)) && again()}
          >×</button>
        </li>
      `)}
    </ul>
  `;
}

function textOf({ found }, typical) {
  if (!found) return "no board found";
  const words = [`${found.points} points`];
  if (found.tilt_rad !== null) words.push(`leans ${Math.round((found.tilt_rad * 180) / Math.PI)}°`);
  if (found.rms_px !== null) words.push(`${fixed(found.rms_px, 2)} px off`);
  if (found.used === false) words.push("left out");
  if (found.sharpness !== null) {
    const share = found.sharpness / typical;
    words.push(share < BLURRED ? "blurred" : `sharpness ${Math.round(100 * share)} %`);
  }
  return words.join(" · ");
}

function Advice({ views, findings }) {
  const shots = [...(findings?.refused ?? []), ...(findings?.shots ?? [])];
  const seen = views.filter((one) => one.found).length;
  if (!shots.length && seen < WANTED) shots.push(`${WANTED - seen} more pictures with the board would do`);
  if (!shots.length) return null;
  return html`
    <div class="advice"><h3>What would help</h3><ul>${shots.map((one) => html`<li key=${one}>${one}</li>`)}</ul></div>
  `;
}

function Lens({ lens, put }) {
  return html`
    <div class="result">
      <h3>${`${lens.lens} lens, ${fixed(lens.rms_px, 3)} px left at the points`}</h3>
      <dl class="numbers">
        ${lens.numbers.map(({ name, value, std }, i) => html`
          <div key=${name}><dt>${name}</dt><dd>${fixed(value, i < 4 ? 2 : 5)} <small>±${fixed(std, i < 4 ? 2 : 5)}</small></dd></div>
        `)}
      </dl>
      <button onClick=${() => put(lens.called)}>Put it in force…</button>
    </div>
  `;
}
