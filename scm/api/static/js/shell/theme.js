/** Light or dark: as the system is set, or as the person chose for this browser. */
import { effect, signal } from "@preact/signals";

const STORAGE_KEY = "scm-theme";
const CHOICES = ["system", "light", "dark"];

const stored = localStorage.getItem(STORAGE_KEY);

/** `system`, `light` or `dark`. */
export const theme = signal(CHOICES.includes(stored) ? stored : "system");

const system = matchMedia("(prefers-color-scheme: light)");
const systemIsLight = signal(system.matches);
system.addEventListener("change", (event) => (systemIsLight.value = event.matches));

/** Counts changes of the colours in force: who draws on a canvas reads it and draws anew. */
export const colours = signal(0);

effect(() => {
  const light = theme.value === "light" || (theme.value === "system" && systemIsLight.value);
  document.documentElement.dataset.theme = light ? "light" : "dark";
  localStorage.setItem(STORAGE_KEY, theme.value);
  colours.value = light ? 1 : 0;
});

export function nextTheme() {
  theme.value = CHOICES[(CHOICES.indexOf(theme.value) + 1) % CHOICES.length];
}
