/** The cars as a table: search, filter by kind, sort by any column; only the rows in sight are made. */
import { computed, signal, useComputed } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { age, fixed } from "scm/shared/format.js";
import { selected } from "scm/shared/selection.js";
import { ageOf, fleet, fleetTick, isAlive, modeOf } from "scm/pages/map/fleet.js";
import { AddCar } from "scm/pages/map/add_car.js";
import { pulse } from "scm/shell/store.js";

const STALE_MS = 500;
const ROW_PX = 28; // as the style sheet has it
const SPARE_ROWS = 8;
const COLUMNS = [
  { name: "name", title: "Name", value: null },
  { name: "owner", title: "Owner", value: (row) => fleet.vehicles[row].owner },
  { name: "mode", title: "Mode", value: modeOf },
  { name: "speed", title: "Speed", unit: "m/s", value: (row) => -Math.abs(fleet.speed[row]), number: true },
  { name: "age", title: "Age", value: (row) => -fleet.age[row], number: true },
];
const KINDS = ["hosted", "remote", "real"];

const words = signal("");
const kind = signal("");
const order = signal({ column: "name", turned: false });
const scrolled = signal(0);
const room = signal(400);

/** Numbers of the rows to show, in their order. */
const shown = computed(() => {
  fleetTick.value;
  const search = words.value.trim().toLowerCase();
  const rows = fleet.order.filter((row) => row < fleet.count && matches(row, search, kind.value));
  const column = COLUMNS.find((one) => one.name === order.value.column);
  if (column.value) {
    const keys = new Map(rows.map((row) => [row, column.value(row)]));
    rows.sort((a, b) => (keys.get(a) < keys.get(b) ? -1 : keys.get(a) > keys.get(b) ? 1 : 0));
  }
  return order.value.turned ? rows.reverse() : rows;
});

function matches(row, search, wantedKind) {
  const car = fleet.vehicles[row];
  if (wantedKind && car.kind !== wantedKind) return false;
  return !search || [car.vehicle, car.owner, car.car, modeOf(row)].some((text) => text.toLowerCase().includes(search));
}

export function VehicleTable() {
  const rows = shown.value;
  const total = fleet.count;
  return html`
    <section class="panel cars" aria-label="Vehicles">
      <div class="panel-head">
        <h2>Vehicles <small>${rows.length === total ? total : `${rows.length} of ${total}`}</small></h2>
        <${AddCar} />
      </div>
      <div class="filters">
        <input
          type="search"
          placeholder="Name, owner, mode"
          aria-label="Filter vehicles by name, owner, car or mode"
          value=${words.value}
          onInput=${(event) => (words.value = event.target.value)}
        />
        <select aria-label="Kind of vehicles" value=${kind.value} onChange=${(event) => (kind.value = event.target.value)}>
          <option value="">All kinds</option>
          ${KINDS.map((name) => html`<option key=${name} value=${name}>${name}</option>`)}
        </select>
      </div>
      <${Rows} rows=${rows} />
    </section>
  `;
}

function Rows({ rows: all }) {
  const box = useRef(null);
  const rows = all.filter((row) => row < fleet.count); // cars that left since the order was made
  useEffect(() => {
    const list = box.current;
    const look = () => {
      scrolled.value = list.scrollTop;
      room.value = list.clientHeight;
    };
    const sizes = new ResizeObserver(look);
    sizes.observe(list);
    list.addEventListener("scroll", look, { passive: true });
    return () => {
      sizes.disconnect();
      list.removeEventListener("scroll", look);
    };
  }, []);
  useEffect(() => reveal(box.current, placeOfChosen(rows)), [selected.value]);
  const first = Math.max(0, Math.min(rows.length, Math.floor(scrolled.value / ROW_PX)) - SPARE_ROWS);
  const last = Math.min(rows.length, first + Math.ceil(room.value / ROW_PX) + 2 * SPARE_ROWS);
  return html`
    <div class="scroll moves" tabindex="0" role="region" aria-label="Table of vehicles" ref=${box} onKeyDown=${(event) => step(event, rows)}>
      <table aria-rowcount=${rows.length + 1}>
        <thead><tr>${COLUMNS.map((column) => html`<${Head} key=${column.name} column=${column} />`)}</tr></thead>
        <tbody>
          ${first > 0 && html`<tr class="spacer" key="above" style=${{ height: `${first * ROW_PX}px` }}></tr>`}
          ${rows.slice(first, last).map((row, i) => {
            const { vehicle } = fleet.vehicles[row];
            return html`<${Car} key=${vehicle} vehicle=${vehicle} row=${row} number=${first + i} />`;
          })}
          ${last < rows.length && html`<tr class="spacer" key="below" style=${{ height: `${(rows.length - last) * ROW_PX}px` }}></tr>`}
        </tbody>
      </table>
      ${!rows.length && html`<p class="empty">${fleet.count ? "No vehicle is like that." : pulse.value.t_ns === null ? "The world is starting." : "No vehicle is on the map."}</p>`}
    </div>
  `;
}

function Head({ column }) {
  const { column: by, turned } = order.value;
  const here = by === column.name;
  const sort = here ? (turned ? "descending" : "ascending") : null;
  const turn = () => (order.value = { column: column.name, turned: here && !turned });
  return html`
    <th class="${column.number ? "number" : ""} of-${column.name}" aria-sort=${sort}>
      <button class="plain" title=${column.unit && `${column.title} in ${column.unit}`} onClick=${turn}>
        ${column.title}<span class="arrow" aria-hidden="true">${here ? (turned ? "▾" : "▴") : ""}</span>
      </button>
    </th>
  `;
}

function Car({ vehicle, row, number }) {
  fleetTick.value; // its properties stay the same while its state in `fleet` changes
  const isChosen = useComputed(() => selected.value === vehicle); // a choice draws two rows anew, not all
  if (row >= fleet.count) return null; // it left a moment ago
  const { kind: sort, owner } = fleet.vehicles[row];
  const chosen = isChosen.value;
  const mode = modeOf(row);
  const old_ms = ageOf(row);
  const choose = () => (selected.value = chosen ? null : vehicle);
  return html`
    <tr
      data-car=${vehicle}
      data-alive=${isAlive(row)}
      class=${chosen ? "chosen" : ""}
      aria-rowindex=${number + 2}
      onClick=${(event) => event.target.closest("button") || choose()}
    >
      <td>
        <span class="kind" data-kind=${isAlive(row) ? sort : "lost"} title=${sort}></span>
        <button class="name" aria-pressed=${chosen} onClick=${choose}>${vehicle}</button>
        <span class="hidden">${sort}</span>
      </td>
      <td class="owner" title=${owner}>${owner}</td>
      <td><span class="mode" data-mode=${mode}>${mode}</span></td>
      <td class="number speed">${fixed(fleet.speed[row], 2)}</td>
      <td class="number age ${old_ms > STALE_MS ? "warn" : ""}">${age(old_ms)}</td>
    </tr>
  `;
}

/** Up and down choose the car before and after. */
function step(event, rows) {
  const way = { ArrowUp: -1, ArrowDown: 1 }[event.key];
  if (!way || !rows.length) return;
  event.preventDefault();
  const here = placeOfChosen(rows);
  const next = here < 0 ? (way > 0 ? 0 : rows.length - 1) : Math.min(rows.length - 1, Math.max(0, here + way));
  selected.value = fleet.vehicles[rows[next]]?.vehicle ?? selected.value;
}

/** Where the chosen car is among rows that were shown a moment ago: cars may have left since. */
function placeOfChosen(rows) {
  return rows.findIndex((row) => fleet.vehicles[row]?.vehicle === selected.value);
}

/** Scroll a row into sight, below the head of the table. */
function reveal(box, number) {
  if (number < 0) return;
  const top = number * ROW_PX;
  const seen = box.clientHeight - 2 * ROW_PX;
  if (top < box.scrollTop) box.scrollTop = top;
  else if (top > box.scrollTop + seen) box.scrollTop = top - seen;
}
