/** Misbehaviour of each transmitting station: polled every two seconds while a page shows it. */
import { signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { placed } from "scm/shared/base.js";

const EVERY_MS = 2000;

/** `{watched, witness, stations, reported}`; null until received. */
export const misbehaviour = signal(null);

export function useMisbehaviour() {
  useEffect(() => {
    let ended = false;
    const poll = async () => {
      const reply = await fetch(placed("/api/v1/misbehaviour")).catch(() => null);
      if (!ended && reply?.ok) misbehaviour.value = await reply.json();
    };
    poll();
    const timer = setInterval(poll, EVERY_MS);
    return () => {
      ended = true;
      clearInterval(timer);
    };
  }, []);
}

/**
 * `{score, suspected, tagUnseen, reported}` of a car, now and since the start; the score is null if it is not
 * watched. `tagUnseen`: the Eye cannot see its tag, which is no accusation.
 */
export function misbehaviourOf(vehicle) {
  const newest = misbehaviour.value;
  const row = newest?.stations.find((one) => one.station === vehicle);
  return {
    score: row?.score ?? null,
    suspected: row?.suspected ?? false,
    tagUnseen: row?.tag_unseen ?? false,
    reported: newest?.reported.includes(vehicle) ?? false,
  };
}
