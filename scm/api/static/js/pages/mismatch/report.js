/** One report as a page: what, where, when, how much, how sure, how much better, and what to drive next. */
import { html } from "scm/shared/html.js";
import { Curves } from "scm/pages/mismatch/curves.js";
import { EffectCard, PlainCard, TogetherCard } from "scm/pages/mismatch/effects.js";
import { useFetched } from "scm/pages/mismatch/fetched.js";
import { FreeRuns } from "scm/pages/mismatch/free_runs.js";
import { Files, Head } from "scm/pages/mismatch/head.js";
import { FitTable, OwnNumbers, Tried } from "scm/pages/mismatch/numbers.js";
import { isQuestion, Question } from "scm/pages/mismatch/question.js";
import { WhereWhen } from "scm/pages/mismatch/where_when.js";

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
  if (!body.drawn || !body.report) return html`<${Bare} report=${body} />`;
  return html`<${Whole} report=${body} again=${again} />`;
}

function Whole({ report, again }) {
  const { report: fields, drawn } = report;
  const effects = drawn.cards.filter((card) => card.kind === "effect").slice(0, fields.effects.length);
  const others = drawn.cards.filter((card) => !effects.includes(card) && !isQuestion(card, drawn));
  const found = new Set(fields.effects.map((effect) => effect.name));
  return html`
    <div class="report">
      <${Head} report=${report} />
      ${drawn.residuals.length > 0 && html`<${WhereWhen} drawn=${drawn} />`}
      <div class="cards">
        ${effects.map(
          (card, i) => html`<${EffectCard} key=${i} card=${card} index=${i} report=${fields} drawn=${drawn} />`,
        )}
        ${others.map((card, i) => html`<${PlainCard} key=${i} card=${card} />`)}
        ${report.together && html`<${TogetherCard} name=${report.row.name} together=${report.together} />`}
      </div>
      ${fields.undecided.map(
        (question, i) => html`
          <${Question}
            key=${i}
            question=${question}
            number=${i}
            report=${report}
            onDriven=${again}
          />
        `,
      )}
      ${drawn.free_runs && html`<${FreeRuns} runs=${drawn.free_runs} />`}
      <div class="columns">
        <div>
          ${fields.fit && html`<${FitTable} fit=${fields.fit} />`}
          <${Curves} curves=${drawn.curves} effects=${drawn.effects} />
        </div>
        <div>
          <${OwnNumbers} numbers=${drawn.numbers} />
          <${Tried} tried=${drawn.tried} found=${found} />
        </div>
      </div>
      ${drawn.other_problems && html`<p class="hint">${drawn.other_problems}</p>`}
    </div>
  `;
}

/** A report that nothing can be drawn of: of an older version, or damaged. */
function Bare({ report }) {
  return html`
    <section class="panel">
      <p class="trail"><a href="/mismatch">Mismatch</a> / ${report.row.name}</p>
      <h2>This report cannot be drawn</h2>
      <p>It was written by an older version, or its files are damaged. What there is can be downloaded.</p>
      <${Files} report=${report} />
    </section>
  `;
}
