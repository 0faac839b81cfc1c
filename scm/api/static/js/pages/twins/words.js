/** States of searches and versions as the page writes them. */
import { spaced } from "scm/shared/format.js";

/** How far the search for a change's cause is: a word or two, and what that means where nothing was found yet. */
export const SEARCHES = {
  driving: ["needs driving", "Its cause is searched for once the car was driven for long enough since."],
  searching: ["searching", "A search for its cause runs."],
  named: ["cause found", ""],
  undecided: ["undecided", "What was driven so far cannot distinguish them."],
  unexplained: ["unexplained", ""],
  elsewhere: ["not the car", ""],
  failed: ["search failed", ""],
};

const at = ({ x_m, y_m, radius_m }) => `the floor within ${radius_m.toFixed(1)} m of (${x_m.toFixed(1)}, ${y_m.toFixed(1)})`;

/** Whose a change may be. */
export const CAUSES = {
  car: () => "the car itself",
  tag: () => "the tag on the car",
  place: (cause) => (cause.x_m === null ? "the floor somewhere" : at(cause)),
  camera: ({ camera }) => `camera ${camera}`.trimEnd(),
  everywhere: () => "the floor everywhere, or the light",
};

export const VERSIONS = {
  candidate: "candidate",
  adopted: "adopted",
  rejected: "rejected",
  rolled_back: "rolled back",
  replaced: "replaced",
};

/** Whether a search has ended with a report to look at. */
export const hasReport = ({ search, report }) => report !== "" && ["named", "undecided", "unexplained"].includes(search);

/** What a change is, in words: what explains it, or what it looks like. */
export function changeInWords(change) {
  if (change.effects.length) return change.effects.map((effect) => effect.text || capital(spaced(effect.name))).join(" ");
  if (change.search === "elsewhere") return `Not the car: ${CAUSES[change.cause](change.causes[0])}`;
  if (change.search === "unexplained") return "No known effect explains it";
  const like = change.between.length ? change.between : [change.effect, ...change.alike];
  return `Looks like ${[...new Set(like)].map(spaced).join(" or ")}`;
}

export const capital = (text) => text.slice(0, 1).toUpperCase() + text.slice(1);
