/** Lists the routes of openapi.json, without anything from elsewhere. */
import { render } from "preact";
import { html } from "scm/shared/html.js";
import { placed } from "scm/shared/base.js";

function Route({ path, method, route, schemas }) {
  const body = route.requestBody?.content?.["application/json"]?.schema;
  const name = body?.$ref?.split("/").pop();
  return html`
    <details>
      <summary><b>${method.toUpperCase()}</b><code>${path}</code><span>${route.summary}</span></summary>
      <dl>
        ${(route.parameters ?? []).map(
          (parameter) => html`
            <dt><code>${parameter.name}</code></dt>
            <dd>${parameter.in} · ${parameter.schema.type ?? "value"} ${parameter.description ?? ""}</dd>
          `,
        )}
      </dl>
      ${name && html`<pre>${JSON.stringify(schemas[name], null, 2)}</pre>`}
    </details>
  `;
}

function Routes({ spec }) {
  const byTag = new Map();
  for (const [path, methods] of Object.entries(spec.paths)) {
    for (const [method, route] of Object.entries(methods)) {
      const tag = route.tags?.[0] ?? "other";
      byTag.set(tag, [...(byTag.get(tag) ?? []), { path, method, route }]);
    }
  }
  const schemas = spec.components?.schemas ?? {};
  return [...byTag].map(
    ([tag, routes]) => html`
      <h2>${tag}</h2>
      ${routes.map((route) => html`<${Route} ...${route} schemas=${schemas} />`)}
    `,
  );
}

const spec = await (await fetch(placed("/api/v1/openapi.json"))).json();
render(html`<${Routes} spec=${spec} />`, document.getElementById("routes"));
