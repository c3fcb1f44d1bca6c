// Builds the calibration page: the session, the steps, the running procedure, and the pan-tilt beside them.

import { changing, fill, focusOn, h, html, need } from "../dom.js";
import { sentence } from "../format.js";
import { icon } from "../icons.js";
import { makeCheckStep, checkProgress } from "./check_step.js";
import { mountDrift } from "./drift.js";
import { makeEverything } from "./everything.js";
import { fitProgress, makeFitStep } from "./fit_step.js";
import { mountInUse } from "./in_use.js";
import { mountJobBar } from "./jobbar.js";
import { Live } from "./live.js";
import { makeMirrorsStep, mirrorsProgress } from "./mirrors_step.js";
import { mountPanTilt } from "./pantilt.js";
import { badge, panel } from "./parts.js";
import { mountRecords } from "./records.js";
import { addressOf, go, PAGES } from "./route.js";
import { makeSessionChoice, mountSessions } from "./sessions.js";
import { makeSettleStep, settleProgress } from "./settle_step.js";
import { makeWideStep, wideProgress } from "./wide_step.js";
import { isRunning } from "./work.js";

/**
 * @import { ConsoleState, WizardPage } from "#page"
 * @typedef {{
 *   store: import("../store.js").Store, orders: import("./orders.js").CalibrationOrders, reader: import("./reader.js").CalibrationReader,
 *   work: import("./work.js").WorkFollower, toasts: import("../toasts.js").Toasts, views: import("../video/views.js").Views
 * }} WizardContext
 * @typedef {{element: HTMLElement, live: HTMLElement | null}} Step `live`: where the live pictures go
 * @typedef {(state: ConsoleState) => {tone: string, text: string} | null} Progress
 */

/** @type {Readonly<Partial<Record<WizardPage, Progress>>>} */
const PROGRESS = Object.freeze({
  wide: wideProgress,
  mirrors: mirrorsProgress,
  fit: fitProgress,
  check: checkProgress,
  settle: settleProgress,
});

/**
 * @param {HTMLElement} place
 * @param {WizardContext} context
 */
export function mountWizard(place, context) {
  const { store } = context;
  const live = new Live({ ...context, homes: { wide: need("wide"), left: need("eyes"), right: need("eyes") } });
  const steps = makeSteps(context);
  const bar = h("div", { class: "jobbar" });
  const turner = h("div", { class: "inside" });
  mountJobBar(bar, context);
  mountPanTilt(turner, context);
  fill(
    place,
    head(context),
    makeTabs(context),
    bar,
    makeDamage(store),
    html`<div class="wizard-body">
      <div class="wizard-step">${[...steps.values()].map(({ element }) => element)}</div>
      <aside class="wizard-side">
        <section class="panel" aria-label="Pan-tilt"><header><h3>Pan-tilt</h3></header>${turner}</section>
      </aside>
    </div>`,
  );
  advance(store);
  store.on(["wizard"], ({ wizard }) => {
    for (const [page, { element, live: slot }] of steps) {
      element.hidden = page !== wizard;
      if (page === wizard && slot) slot.append(live.element);
    }
    turnPage(place, wizard);
  });
}

/**
 * @param {WizardContext} context
 * @returns {Map<WizardPage, Step>}
 */
function makeSteps(context) {
  return new Map(
    /** @type {[WizardPage, Step][]} */ ([
      ["overview", makeOverview(context)],
      ["wide", makeWideStep(context)],
      ["mirrors", makeMirrorsStep(context)],
      ["fit", makeFitStep(context)],
      ["check", makeCheckStep(context)],
      ["settle", makeSettleStep(context)],
    ]).map(([page, step]) => {
      Object.assign(step.element, { id: `step-${page}`, tabIndex: -1 });
      step.element.setAttribute("role", "region");
      step.element.setAttribute("aria-labelledby", `to-${page}`);
      return [page, step];
    }),
  );
}

/**
 * @param {WizardContext} context
 * @returns {Step}
 */
function makeOverview(context) {
  const [records, drift, inUse, sessions] = [stack(), stack(), stack(), stack()];
  mountRecords(records, context);
  mountDrift(drift, context);
  mountInUse(inUse, context.store);
  mountSessions(sessions, context);
  const element = h(
    "div",
    { class: "step step-overview" },
    html`<div class="column">${panel("In use", inUse)}${panel("Measurements", sessions)}</div>`,
    html`<div class="column">${panel("Records", records)}${panel("Drift", drift)}</div>`,
  );
  return { element, live: null };
}

function stack() {
  return h("div", { class: "stack" });
}

/** @param {WizardContext} context */
function head(context) {
  const calibrateEverything = makeEverything(context);
  return html`<div class="wizard-head">
    <h2 id="wizard-title" tabindex="-1">Calibration</h2>
    ${makeSessionChoice(context)}
    <button type="button" class="plain primary" @click=${() => calibrateEverything()}>
      ${icon("scope")}
      Calibrate everything
    </button>
    <a class="plain back" href=${addressOf(null)} aria-label="Back to the console">
      ${icon("back")}
      <span>Console</span>
    </a>
  </div>`;
}

/**
 * Show which parts of the open session cannot be read.
 * @param {WizardContext["store"]} store
 */
function makeDamage(store) {
  const place = h("div", { class: "strip warn damage", role: "status" });
  const show = changing(place, (/** @type {string[]} */ problems) => [
    icon("warn"),
    html`<ul>${problems.map((problem) => html`<li>${sentence(problem)}</li>`)}</ul>`,
  ]);
  store.on(["session"], ({ session }) => {
    const problems = session?.problems ?? [];
    place.hidden = problems.length === 0;
    show(problems);
  });
  return place;
}

/** @param {WizardContext} context */
function makeTabs({ store }) {
  const links = PAGES.map(({ page, title }) => ({
    page,
    link: h("a", { href: addressOf(page), id: `to-${page}` }, html`<span>${title}</span>`),
    mark: h("span", { class: "mark" }),
  }));
  const shows = links.map(({ page, mark }) => ({
    page,
    show: changing(mark, (/** @type {{tone: string, text: string} | null} */ now) =>
      now ? [badge(now.tone, now.text)] : [],
    ),
  }));
  for (const { link, mark } of links) link.append(mark);
  const uncover = () =>
    requestAnimationFrame(() =>
      links
        .find(({ page }) => page === store.state.wizard)
        ?.link.scrollIntoView({ block: "nearest", inline: "center" }),
    );
  let known = "";
  store.on(["wizard"], ({ wizard }) => {
    for (const { page, link } of links) {
      if (page === wizard) link.setAttribute("aria-current", "step");
      else link.removeAttribute("aria-current");
    }
    uncover();
  });
  store.on(["session"], (state) => {
    for (const { page, show } of shows) show(PROGRESS[page]?.(state) ?? null);
    if (state.session && state.session.id !== known) uncover(); // new marks have moved the tabs
    known = state.session?.id ?? "";
  });
  return html`<nav class="wizard-tabs" aria-label="Steps of calibrating">${links.map(({ link }) => link)}</nav>`;
}

/**
 * During a complete calibration, open the step that begins, unless the operator has opened another page.
 * @param {WizardContext["store"]} store
 */
function advance(store) {
  let before = "";
  store.on(["work"], ({ work, wizard }) => {
    const stage = work && isRunning(work) && work.step === "all" ? work.stage : "";
    if (stage === before) return;
    const following = wizard === before || (wizard === "overview" && before === "all");
    before = stage;
    const next = PAGES.find(({ page }) => page === stage);
    if (following && next) go(next.page);
  });
}

/**
 * Show or hide the wizard, and move the focus to what is then visible.
 * @param {HTMLElement} place
 * @param {WizardPage | null} wizard
 */
function turnPage(place, wizard) {
  const open = wizard !== null;
  if (open === !place.hidden) return;
  place.hidden = !open;
  need("console").hidden = open;
  window.scrollTo(0, 0);
  focusOn(need(open ? "wizard-title" : "console"));
}
