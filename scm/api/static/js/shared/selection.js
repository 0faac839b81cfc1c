/** Which car is looked at, on the map, in the table and in the picture alike; null: none. */
import { signal } from "@preact/signals";

export const selected = signal(null);
