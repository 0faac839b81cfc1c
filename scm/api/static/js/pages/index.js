/** The pages, in the order of the bar; one that is `under` another is reached from there. One page is one folder: `page.js` with its `Page`, and one style sheet. */
export const PAGES = [
  { name: "map", title: "Map", load: () => import("scm/pages/map/page.js") },
  { name: "signals", title: "Signals", load: () => import("scm/pages/signals/page.js") },
  { name: "vehicles", title: "Vehicles", load: () => import("scm/pages/vehicle/page.js") },
  { name: "cars", title: "Car files", under: "vehicles", load: () => import("scm/pages/cars/page.js") },
  { name: "twins", title: "Twins", load: () => import("scm/pages/twins/page.js") },
  { name: "eye", title: "Eye", load: () => import("scm/pages/eye/page.js") },
  { name: "recordings", title: "Recordings", load: () => import("scm/pages/recordings/page.js") },
  { name: "mismatch", title: "Mismatch", load: () => import("scm/pages/mismatch/page.js") },
  { name: "events", title: "Events", load: () => import("scm/pages/events/page.js") },
];
