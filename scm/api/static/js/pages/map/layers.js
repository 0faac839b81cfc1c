/** What the map shows beside roads, cars and signals; stored for this browser. */
import { effect, signal } from "@preact/signals";

const STORAGE_KEY = "scm-map-layers";

/** Name to title, in the order of the menu; the last three are of the chosen car. */
export const LAYERS = {
  names: "Names of cars",
  roads: "Names of lanes, junctions, places",
  times: "Time to change of signals",
  trails: "Trails",
  heat: "Heat map of speed",
  tracks: "Tracks of the Eye",
  autonomy: "Plans of cars that park themselves",
  rooms: "Maps that cars make",
  places: "Places whose floor changed",
  costmap: "Costmap of the chosen car",
  path: "Planned path of the chosen car",
  lidar: "LIDAR of the chosen car",
};

const FIRST = { names: true, roads: false, times: true, trails: false, heat: false, tracks: false, autonomy: true, rooms: true, places: true, costmap: false, path: true, lidar: false };

/** Name to whether it is shown. */
export const layers = signal({ ...FIRST, ...read() });

/** Name of the car that the map keeps in its middle; null: none. */
export const followed = signal(null);

function read() {
  try {
    const stored = JSON.parse(localStorage.getItem(STORAGE_KEY) ?? "{}");
    return Object.fromEntries(Object.entries(stored).filter(([name]) => name in LAYERS));
  } catch {
    return {};
  }
}

effect(() => localStorage.setItem(STORAGE_KEY, JSON.stringify(layers.value)));

export function show(name, on) {
  layers.value = { ...layers.value, [name]: on };
}
