/** One car: how its twin is, what changed and since when, and the versions of its file. */
import { coded } from "scm/shared/coded.js";
import { useFetched } from "scm/shared/fetched.js";
import { moment, span } from "scm/shared/format.js";
import { html } from "scm/shared/html.js";
import { Change } from "scm/pages/twins/change.js";
import { TimeLine } from "scm/pages/twins/time_line.js";
import { Versions } from "scm/pages/twins/versions.js";
import { PartLost, TwinState } from "scm/pages/twins/watching.js";

const EVERY_MS = 2000;

export function Car({ name }) {
  const { body, error, again } = useFetched(`/twins/${encodeURIComponent(name)}`, EVERY_MS);
  if (!body) {
    return html`
      <section class="panel nobody" aria-label="Twin of ${name}">
        <p class="trail"><a href="/twins">Twins</a> / ${name}</p>
        <h2>${error ? `Nothing is known of ${name}` : "Waiting for the city"}</h2>
        ${error && html`<p role="alert">${coded(error)}</p>`}
      </section>
    `;
  }
  const changes = body.changes.toReversed();
  return html`
    <section class="panel head" aria-label="State">
      <p class="trail"><a href="/twins">Twins</a> / ${name}</p>
      <h2><${TwinState} state=${body.state} /></h2>
      <p class="facts">
        <span>Car <a href="/vehicles/${name}">${name}</a>, a ${body.car}</span>
        <span>driven and watched for ${span(body.driven_s)}</span>
        <span>predicted by version ${body.version}</span>
        <span>looked at until ${moment(body.t_ns)}</span>
      </p>
      <${PartLost} />
      ${error && html`<p class="warn" role="status">${error}</p>`}
      <${State} car=${body} />
      ${changes.length > 0 && html`<${TimeLine} car=${body} />`}
    </section>
    <section class="changes" aria-label="Changes">
      ${changes.map((one) => html`
        <${Change} key=${one.noticed_ns} vehicle=${name} change=${one} now_ns=${body.t_ns} onChanged=${again} />
      `)}
      ${!changes.length && html`<div class="panel"><p class="empty">No change was noticed.</p></div>`}
    </section>
    <${Versions} car=${body} onChanged=${again} />
  `;
}

function State({ car }) {
  if (car.state === "blind") return html`<p class="bad">It cannot be watched: ${car.reason}.</p>`;
  if (car.state === "watching") return null;
  return html`
    <p class="quiet">
      It learns how this car usually strays. In the first 200 s of driving nothing is noticed, until 600 s only plain changes.
    </p>
  `;
}
