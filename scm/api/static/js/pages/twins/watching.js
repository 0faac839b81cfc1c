/** Whether cars are watched, and how each is: in shape, word and colour. */
import { html } from "scm/shared/html.js";
import { STATES, twinRows } from "scm/shared/twins.js";
import { city, stations, topic } from "scm/shell/store.js";

export const TwinState = ({ state }) => html`<span class="state" data-state=${state}><i></i>${STATES[state]}</span>`;

const isHere = () => stations.value.some((one) => one.name === "twin" && one.role === "part" && one.alive);

/** That the part is gone, where it has reported before. */
export function PartLost() {
  if (topic("stations").value === null || isHere()) return null;
  return html`<p class="warn" role="status">The twin part is gone: this is what it reported last.</p>`;
}

/** What to do where there is no car to show. */
export function Nobody() {
  const isKnown = topic("stations").value !== null && twinRows() !== null;
  return html`
    <section class="panel nobody" aria-label="Watched cars">
      ${!isKnown && html`<h2>Waiting for the city</h2>`}
      ${isKnown && isHere() && html`
        <h2>No car was looked at yet</h2>
        <p>The first look needs ten seconds of a car's reports.</p>
      `}
      ${isKnown && !isHere() && html`
        <h2>Nobody watches the cars of this city</h2>
        <p>
          A twin drives each car again by its commands, and says since when it is not what its car file says any
          more, what changed, and which file follows it better. Start the city with it:
        </p>
        <p><code>scm up ${city.value?.name ?? "MAP"} --twin</code></p>
      `}
    </section>
  `;
}
