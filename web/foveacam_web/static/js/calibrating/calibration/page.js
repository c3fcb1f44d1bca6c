// Builds the calibration page: the session, the steps, the running procedure, and the pan-tilt beside them.

import { ACCEPTANCE_ADDRESS, WIZARD_PAGES, wizardAddress } from "../../addresses.js";
import { absent, fill, h, html, update } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { pageHead } from "../../pages.js";
import { makeCheckStep, checkProgress } from "./fit/check_step.js";
import { mountDisplays } from "./displays/displays.js";
import { mountDrift } from "./records/drift.js";
import { makeEverything } from "./everything.js";
import { fitProgress, makeFitStep } from "./fit/fit_step.js";
import { inUse } from "./records/in_use.js";
import { mountJobBar } from "./jobbar.js";
import { Live } from "./live.js";
import { makeMirrorsStep, mirrorsProgress } from "./mirrors/mirrors_step.js";
import { mountPanTilt } from "./pantilt.js";
import { badge, panel, textButton } from "../../elements/parts.js";
import { mountRecords } from "./records/records.js";
import { makeSessionChoice, mountSessions } from "./sessions.js";
import { makeSettleStep, settleProgress } from "./mirrors/settle_step.js";
import { makeWideStep, wideProgress } from "./lens/wide_step.js";
import { isRunning } from "./state.js";

/**
 * @import { ConsoleState, WizardPage } from "#page"
 * @typedef {{
 *   store: import("../../store.js").Store, orders: import("./orders.js").CalibrationOrders, reader: import("./reader.js").CalibrationReader,
 *   work: import("./work.js").WorkFollower, toasts: import("../../elements/toasts.js").Toasts, views: import("../../video/views.js").Views
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

/** @param {HTMLElement} place @param {WizardContext} context @returns {import("../../pages.js").Slots} */
export function mountWizard(place, context) {
  const { store } = context;
  const live = new Live(context);
  const steps = makeSteps(context);
  const bar = h("div", { class: "jobbar" });
  const turner = h("div", { class: "inside" });
  const displays = h("div", { class: "inside" });
  mountJobBar(bar, context);
  mountPanTilt(turner, context);
  mountDisplays(displays, context);
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
        <section class="panel" aria-label="Displays"><header><h3>Displays</h3></header>${displays}</section>
      </aside>
    </div>`,
  );
  advance(store);
  store.on(["wizard"], ({ wizard }) => {
    for (const [page, { element, live: slot }] of steps) {
      element.hidden = page !== wizard;
      if (page === wizard && slot) slot.append(live.element);
    }
  });
  return live.slots;
}

/** @param {WizardContext} context @returns {Map<WizardPage, Step>} */
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

/** @param {WizardContext} context @returns {Step} */
function makeOverview(context) {
  const [records, drift, used, sessions] = [stack(), stack(), stack(), stack()];
  mountRecords(records, context);
  mountDrift(drift, context);
  context.store.on(["rig", "health"], (state) => update(used, inUse(state)));
  mountSessions(sessions, context);
  const element = h(
    "div",
    { class: "step step-overview" },
    html`<div class="column">${panel("In use", used)}${toAcceptance()}${panel("Measurements", sessions)}</div>`,
    html`<div class="column">${panel("Records", records)}${panel("Drift", drift)}</div>`,
  );
  return { element, live: null };
}

function toAcceptance() {
  return panel(
    "Acceptance",
    html`<p class="lead">A new rig, or one that was moved? It measures itself and names what is wrong.</p>`,
    html`<p class="actions"><a class="plain" href=${ACCEPTANCE_ADDRESS}>${icon("check")}Open the acceptance</a></p>`,
  );
}

function stack() {
  return h("div", { class: "stack" });
}

/** @param {WizardContext} context */
function head(context) {
  const calibrateEverything = makeEverything(context);
  const all = textButton("Calibrate everything", () => calibrateEverything(), {
    kind: "plain primary",
    picture: "scope",
  });
  return pageHead("wizard-title", "Calibration", makeSessionChoice(context), all);
}

/** Show which parts of the open session cannot be read. @param {WizardContext["store"]} store */
function makeDamage(store) {
  const place = h("div", { class: "strip warn damage", role: "status" });
  store.on(["session"], ({ session }) => {
    const problems = session?.problems ?? [];
    place.hidden = problems.length === 0;
    update(place, html`${icon("warn")}<ul>${problems.map((problem) => html`<li>${sentence(problem)}</li>`)}</ul>`);
  });
  return place;
}

/** @param {WizardContext} context */
function makeTabs({ store }) {
  const nav = h("nav", { class: "wizard-tabs", "aria-label": "Steps of calibrating" });
  let uncovered = "";
  store.on(["wizard", "session"], (state) => {
    const { wizard, session } = state;
    const tab = (/** @type {(typeof WIZARD_PAGES)[number]} */ { page, title }) => {
      const mark = PROGRESS[page]?.(state);
      return html`<a href=${wizardAddress(page)} id="to-${page}" aria-current=${page === wizard ? "step" : absent}>
        <span>${title}</span><span class="mark">${mark && badge(mark.tone, mark.text)}</span>
      </a>`;
    };
    update(nav, WIZARD_PAGES.map(tab));
    const now = `${wizard} ${session?.id}`; // new marks move the tabs
    if (now !== uncovered) requestAnimationFrame(() => showCurrent(nav));
    uncovered = now;
  });
  return nav;
}

/** @param {HTMLElement} nav */
function showCurrent(nav) {
  nav.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest", inline: "center" });
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
    const next = WIZARD_PAGES.find(({ page }) => page === stage);
    if (following && next) location.hash = wizardAddress(next.page);
  });
}
