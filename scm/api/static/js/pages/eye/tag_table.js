/** All tags that a camera saw within the last minute. */
import { html } from "scm/shared/html.js";
import { fixed, span, UNKNOWN } from "scm/shared/format.js";
import { chosenTag } from "scm/pages/eye/chosen.js";

const LATE_S = 1;

export function TagTable({ camera }) {
  const tags = camera.known.toSorted((a, b) => a.tag_id - b.tag_id);
  return html`
    <section class="panel eye-tags" aria-label="Tags">
      <div class="panel-head">
        <h2>Tags</h2>
        <span class="facts">
          of the last minute · <a href="/api/v1/eye/print/tags.pdf" target="_blank" title="Roof tags of all cars in the city, and the map's tag: PDF at true size">Print tags</a>
        </span>
      </div>
      ${tags.length ? html`<div class="scroll moves" tabindex="0" role="region" aria-label="Table of tags"><${Table} tags=${tags} /></div>` : html`<p class="empty">No tag has been seen for a minute.</p>`}
    </section>
  `;
}

function Table({ tags }) {
  return html`
    <table>
      <thead>
        <tr>
          <th scope="col">Tag</th>
          <th scope="col">Whose</th>
          <th scope="col" class="number" title="Decision margin of the detector: higher is clearer">Margin</th>
          <th scope="col" class="number" title="Bits of its 36 that were read wrong and corrected (hamming)">Bits</th>
          <th scope="col" class="number" title="Mean side of its black square in the picture">Size</th>
          <th scope="col" class="number" title="x, y on the map">Place</th>
          <th scope="col" class="number">Yaw</th>
          <th scope="col" class="number">Seen</th>
        </tr>
      </thead>
      <tbody>
        ${tags.map((tag) => html`<${Row} key=${tag.tag_id} tag=${tag} />`)}
      </tbody>
    </table>
  `;
}

function Row({ tag }) {
  const chosen = chosenTag.value === tag.tag_id;
  const choose = () => (chosenTag.value = chosen ? null : tag.tag_id);
  return html`
    <tr class=${chosen ? "chosen" : ""} data-tag=${tag.tag_id}>
      <td>
        <button class="name" aria-pressed=${chosen} title="Mark it in the picture" onClick=${choose}>
          ${tag.tag_id}
        </button>
      </td>
      <td>${whose(tag)}</td>
      <td class="number more" data-what="margin">${fixed(tag.margin, 0)}</td>
      <td class="number more ${tag.hamming ? "warn" : ""}" data-what="bits">${tag.hamming ?? UNKNOWN}</td>
      <td class="number more" data-what="size">${fixed(tag.size_px, 1, " px")}</td>
      <td class="number place">${tag.x_m === null ? UNKNOWN : `${fixed(tag.x_m, 2)}, ${fixed(tag.y_m, 2)} m`}</td>
      <td class="number">${tag.yaw_rad === null ? UNKNOWN : fixed((tag.yaw_rad * 180) / Math.PI, 0, "°")}</td>
      <td class="number ${tag.seen_s > LATE_S ? "warn" : ""}">${span(tag.seen_s)}</td>
    </tr>
  `;
}

function whose(tag) {
  if (tag.what === "map") return html`<span class="floor">on the floor</span>`;
  if (tag.what === "other") return html`<span class="warn">nobody's</span>`;
  return html`<a href=${`/vehicles/${tag.vehicle}`}>${tag.vehicle}</a>`;
}
