/** Which tag is looked at, in the table and in the picture alike; null: none. */
import { signal } from "@preact/signals";

export const chosenTag = signal(null);
