/** One report: its page `report.html`, and what the city can do about it. */
import { useEffect, useRef, useState } from "preact/hooks";
import { placed } from "scm/shared/base.js";
import { html } from "scm/shared/html.js";
import { useFetched } from "scm/shared/fetched.js";
import { Head } from "scm/pages/mismatch/head.js";
import { linkMoments } from "scm/pages/mismatch/moments.js";
import { Question } from "scm/pages/mismatch/question.js";

export function Report({ name }) {
  const { body, error, again } = useFetched(`/mismatch/reports/${encodeURIComponent(name)}`);
  if (error) {
    return html`
      <section class="panel" role="alert">
        <p class="trail"><a href="/mismatch">Mismatch</a> / ${name}</p>
        <h2>The report cannot be shown</h2>
        <p>${error}</p>
      </section>
    `;
  }
  if (!body) return html`<p class="empty">Reading the report …</p>`;
  const questions = body.drawn && body.report ? body.report.undecided : [];
  return html`
    <div class="report">
      <${Head} report=${body} />
      <${Sheet} report=${body}>
        ${body.together && html`<${Together} name=${name} together=${body.together} />`}
        ${questions.map(
          (question, i) => html`<${Question} key=${i} question=${question} number=${i} report=${body} onDriven=${again} />`,
        )}
      <//>
    </div>
  `;
}

/** The report's own page, in its own style; children stand below its first screen. */
function Sheet({ report, children }) {
  const ref = useRef(null);
  const [error, setError] = useState("");
  const address = `/api/v1/mismatch/reports/${encodeURIComponent(report.row.name)}/files/report.html`;
  useEffect(() => {
    const quit = new AbortController();
    fetch(placed(address), { signal: quit.signal })
      .then((response) => (response.ok ? response.text() : Promise.reject(new Error("its page is missing"))))
      .then((text) => show(ref.current, text, report.drawn))
      .catch((reason) => quit.signal.aborted || setError(reason.message));
    return () => quit.abort();
  }, [address]);
  if (error) return html`<p class="panel" role="alert">The report cannot be drawn: ${error}.</p>`;
  return html`<div class="sheet" ref=${ref}><div class="below">${children}</div></div>`;
}

function show(host, text, drawn) {
  const within = (tag) => text.split(`<${tag}>`)[1]?.split(`</${tag}>`)[0] ?? "";
  const style = new CSSStyleSheet();
  style.replaceSync(`${within("style")} main { max-width: none; padding: 0; }`);
  const root = host.shadowRoot ?? host.attachShadow({ mode: "open" });
  root.adoptedStyleSheets = [style];
  const page = new DOMParser().parseFromString(`<main>${within("main")}</main>`, "text/html");
  page.querySelectorAll("script, iframe, object, embed, form").forEach((one) => one.remove()); // it has none
  root.replaceChildren(page.querySelector("main"));
  const below = document.createElement("slot");
  (root.querySelector(".cards") ?? root.querySelector("main")).after(below);
  for (const link of root.querySelectorAll('a[href^="#"]')) {
    link.addEventListener("click", (event) => {
      event.preventDefault(); // an address within a shadow tree is none of the document's
      root.querySelector(link.getAttribute("href"))?.scrollIntoView();
    });
  }
  if (drawn) linkMoments(root, drawn);
}

/** What the cars of one search share, and the way to each one's report. */
function Together({ name, together }) {
  const others = together.cars.filter((car) => car !== name);
  return html`
    <article class="panel card" data-kind="together">
      <p class="label">Together with the other cars</p>
      <h2>${together.said}</h2>
      ${together.conclusions.map((text) => html`<p key=${text}>${text}</p>`)}
      <p>
        Their reports:
        ${others.map((car, i) => html`${i ? ", " : " "}<a key=${car} href="/mismatch/${car}">${car.split(".")[1]}</a>`)}
      </p>
    </article>
  `;
}
