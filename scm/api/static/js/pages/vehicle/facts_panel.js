/** What is known of a car: where it is, who drives it, how far away it is, and whether to believe it. */
import { useEffect, useState } from "preact/hooks";
import { autonomyOf, stateInWords } from "scm/shared/autonomy.js";
import { stuckBy } from "scm/shared/condition.js";
import { html } from "scm/shared/html.js";
import { age, fixed, span, UNKNOWN } from "scm/shared/format.js";
import { twinInWords, twinOf } from "scm/shared/twins.js";
import { since_ms } from "scm/shell/store.js";
import { Battery } from "scm/pages/vehicle/battery.js";
import { isAtHome, ownerOf } from "scm/pages/vehicle/lease.js";
import { misbehaviourOf, misbehaviour, useMisbehaviour } from "scm/pages/vehicle/misbehaviour.js";
import { placed } from "scm/shared/base.js";

const LINK_MS = 1000;
const STALE_MS = 500;
const LATE_MS = 150; // from here on the car's guard lets go of the throttle
const DEGREES = 180 / Math.PI;

export function FactsPanel({ car }) {
  useMisbehaviour();
  const link = useLink(car.vehicle);
  const { x_m: x, y_m: y, yaw_rad: yaw } = car;
  const parking = autonomyOf(car.vehicle);
  const twin = twinOf(car.vehicle);
  const age_ms = car.age_ms + since_ms.value;
  return html`
    <section class="panel facts" aria-label="State">
      <div class="panel-head"><h2>State</h2></div>
      <dl class="moves" data-stale=${age_ms > STALE_MS}>
        <dt>Pose</dt><dd>${fixed(x, 2)}, ${fixed(y, 2)} m, ${fixed(yaw * DEGREES, 0, "°")}</dd>
        ${stuckBy(car) && html`<dt>Stuck</dt><dd data-fact="stuck" class="bad">${stuckBy(car)}</dd>`}
        <dt>Throttle</dt><dd>${fixed(car.throttle, 2)}</dd>
        <dt>Steering</dt><dd>${fixed(car.steering_rad * DEGREES, 1, "°")} <small>${side(car.steering_rad)}</small></dd>
        <dt>Battery</dt><dd data-fact="battery"><${Battery} car=${car} /></dd>
        <dt>Trip</dt><dd>${tripOf(car.trip)}</dd>
        ${parking && html`<dt>Parking</dt><dd data-fact="parking">${stateInWords(parking)}</dd>`}
        <dt>Driven by</dt><dd class=${isAtHome(car) ? "" : "warn"}>${ownerOf(car)}</dd>
        <dt>Lease</dt><dd>${isAtHome(car) ? "at home" : `ends in ${span(car.lease_left_ms / 1000)}`}</dd>
        <dt>Epoch</dt><dd>${car.epoch}</dd>
        <dt>Command age</dt><dd data-fact="command" class=${car.command_age_ms > LATE_MS ? "warn" : ""}>${commandOf(car)}</dd>
        <dt>Last report</dt><dd class=${age_ms > STALE_MS ? "warn" : ""}>${age(age_ms)} <small>ago</small></dd>
        <dt>Round trip</dt><dd data-fact="link" title=${link?.title ?? ""}>${link?.text ?? UNKNOWN}</dd>
        <dt>Eye sees it off by</dt><dd>${eyeOf(car.eye)}</dd>
        ${twin && html`<dt>Twin</dt><dd data-fact="twin"><a href="/twins/${car.vehicle}">${twinInWords(twin)}</a></dd>`}
        <dt>Misbehaviour</dt><dd class=${misbehaviourOf(car.vehicle).suspected ? "bad" : ""}>${misbehaviourText(car.vehicle)}</dd>
      </dl>
    </section>
  `;
}

/** The way to the car's owner and back, measured once a second while the page is looked at. */
function useLink(vehicle) {
  const [link, setLink] = useState(null);
  useEffect(() => {
    let ended = false;
    const poll = async () => {
      if (document.hidden) return;
      const reply = await fetch(placed(`/api/v1/vehicles/${vehicle}/link`)).catch(() => null);
      const body = await reply?.json().catch(() => null);
      if (ended || !reply) return;
      setLink(
        reply.ok
          ? { text: `${fixed(body.round_trip_ms, 1)} ms`, title: `answered by its ${body.answered_by}` }
          : { text: "no answer", title: body?.detail ?? "" },
      );
    };
    poll();
    const timer = setInterval(poll, LINK_MS);
    return () => {
      ended = true;
      clearInterval(timer);
    };
  }, [vehicle]);
  return link;
}

function side(angle) {
  if (Math.abs(angle) * DEGREES < 0.5) return "";
  return angle > 0 ? "left" : "right";
}

function commandOf(car) {
  if (isAtHome(car)) return "drives itself";
  return car.command_age_ms === null ? "none came yet" : age(car.command_age_ms);
}

function tripOf(trip) {
  if (!trip) return "none";
  const done = trip.arrived ? "arrived" : underWay(trip);
  return trip.void.length ? `${done}; its time is void: ${trip.void.join("; ")}` : done;
}

function underWay(trip) {
  const way = trip.length_m === null ? `circulates, ${fixed(trip.done_m, 1)} m so far` : `${fixed(trip.done_m, 1)} of ${fixed(trip.length_m, 1)} m`;
  return trip.waiting_for ? `${way}; waits for ${trip.waiting_for}` : way;
}

function eyeOf(eye) {
  return eye ? `${fixed(eye.position_mm, 1)} mm, ${fixed(eye.yaw_deg, 1, "°")}` : "not seen";
}

function misbehaviourText(vehicle) {
  if (!misbehaviour.value?.watched) return "nobody watches";
  const { score, suspected, tagUnseen, reported } = misbehaviourOf(vehicle);
  const unseen = tagUnseen ? "; the Eye cannot see its tag" : "";
  const now = score === null ? "not on the air" : `score ${fixed(score, 1)}${unseen}`;
  if (suspected) return `${now}, suspected`;
  return reported ? `${now}, was reported` : now;
}
