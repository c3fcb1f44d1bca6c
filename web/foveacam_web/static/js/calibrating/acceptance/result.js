// Shows one acceptance run: its verdict, what was found and what to do, and each check with its figures and picture.

import { html, keyed } from "../../elements/dom.js";
import { dayTime, sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { badge, panel } from "../../elements/parts.js";
import { API } from "../../root.js";
import { figure } from "../calibration/pictures.js";
import { missingStations } from "../missing_stations.js";
import { circumstances, figureRow, findingsOf, lackedMarkers, VERDICTS, verdictOf } from "./words.js";

/**
 * @import { AcceptanceCheckDocument, AcceptanceDocument } from "#api"
 * @typedef {ReturnType<typeof findingsOf>[number]} NamedFinding
 */

/** Why a run needs stations. */
export const WHY = "Without markers most checks cannot be made.";

/**
 * @param {{run: AcceptanceDocument, newest: boolean, simulated: boolean}} shown
 * @param {import("../calibration/orders.js").CalibrationOrders} orders
 */
export function resultOf({ run, newest, simulated }, orders) {
  const findings = findingsOf(run);
  return keyed(
    run.id,
    html`<div class="column">
      ${panel(newest ? "Newest result" : "Earlier result", ...verdict(run), lackedMarkers(run) && missingStations({ simulated, why: WHY }, orders))}
      ${findings.length > 0 && panel("What was found, and what to do", findingList(findings))}
      ${panel("Checks", checkList(run))}
    </div>`,
  );
}

/** @param {AcceptanceDocument} run */
function verdict(run) {
  const { tone, text, reason } = verdictOf(run);
  return [
    html`<p class="verdict state ${tone}" role="status">${icon(tone === "good" ? "check" : "warn")}${text}</p>`,
    html`<p>${reason}</p>`,
    html`<p class="legend">
      <time datetime=${run.created_utc}>${dayTime(run.created_utc)}</time>
      ${circumstances(run).map((text) => html`<span>${text}</span>`)}
    </p>`,
    html`<p class="actions">
      <a class="plain" href="${API}/acceptances/${run.id}/report.html" target="_blank" rel="noopener">
        ${icon("file")}Open the report
      </a>
    </p>`,
  ];
}

/** @param {NamedFinding[]} findings */
function findingList(findings) {
  return html`<ul class="findings stack">${findings.map(
    ({ detail, remedy, check }) => html`<li>
      <p class="state bad">${icon("warn")}${sentence(detail)}</p>
      <p class="remedy">${sentence(remedy)}</p>
      <p class="why">${check}</p>
    </li>`,
  )}</ul>`;
}

/** @param {AcceptanceDocument} run */
function checkList({ id, checks }) {
  return html`<ul class="checks">${checks.map(
    (check) => html`<li data-check=${check.name}>${checkOf(check, id)}</li>`,
  )}</ul>`;
}

/** Build a check; one that has neither figures nor a picture is not expandable. @param {AcceptanceCheckDocument} check @param {string} run_id */
function checkOf(check, run_id) {
  const { tone, text } = VERDICTS[check.verdict];
  const head = html`${badge(tone, text)}<span>${check.title}</span>`;
  const why = [check.note, ...check.findings.map(({ detail }) => detail)].filter(Boolean);
  const reasons = why.map((text) => html`<p class="why">${sentence(text)}</p>`);
  if (check.figures.length === 0 && check.picture === null)
    return html`<div class="head">${head}</div>${reasons.length > 0 && html`<div class="more">${reasons}</div>`}`;
  return html`<details ?open=${check.verdict === "failed"}>
    <summary class="head">${head}</summary>
    <div class="more">
      ${reasons} ${check.figures.length > 0 && figureList(check.figures)}
      ${check.picture !== null && picture(check.title, check.picture, run_id)}
    </div>
  </details>`;
}

/** @param {AcceptanceCheckDocument["figures"]} figures */
function figureList(figures) {
  return html`<ul class="measured">${figures.map(figureRow).map(
    ({ name, value, limits, within }) => html`<li class=${within ? "" : "outside"}>
      <span>${name}</span><b class="number">${value}</b><i class="number">${limits}</i>
      ${limits !== "" && (within ? html`<span>within</span>` : badge("bad", "outside"))}
    </li>`,
  )}</ul>`;
}

/** @param {string} title @param {string} name @param {string} run_id */
function picture(title, name, run_id) {
  return figure({ name, title, url: `${API}/acceptances/${run_id}/pictures/${name}.png` });
}
