/**
 * Sentences as people read them: names of the map and words of the signals without their underscores, the
 * map by its title. What is not known, a file or a field, stays as it was written.
 */
import { computed } from "@preact/signals";
import { spaced } from "scm/shared/format.js";
import { city } from "scm/shell/store.js";

const WORDS = [
  ...["force_off", "max_pressure", "flashing_red"],
  ...["short_green", "short_yellow", "short_clearance", "skipped_yellow", "clock_jump"],
];
const NAMED = new Set(["name", "junction", "group", "lane"]);
const ID = /(?<![\w./-])[a-z0-9]+(?:_[a-z0-9]+)+(?![\w/-]|\.\w)/gi;

/** Id to what a person calls it. */
const plainNames = computed(() => {
  const found = new Map(WORDS.map((word) => [word, spaced(word)]));
  const gather = (value) => {
    for (const [key, one] of Object.entries(value)) {
      if (one && typeof one === "object") gather(one);
      else if (typeof one === "string" && NAMED.has(key)) found.set(one, spaced(one));
    }
  };
  if (city.value) gather(city.value);
  if (city.value?.title) found.set(city.value.name, city.value.title);
  return found;
});

/** @param {string} text a sentence of the log, an answer of the server */
export const prose = (text) => text.replace(ID, (id) => plainNames.value.get(id) ?? id);
