// The acceptance page: starts a run, follows it, and shows the newest result and those before it.

import { wizardAddress } from "../../addresses.js";
import { changing, fill, h, html, setText, update } from "../../elements/dom.js";
import { dayTime } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { badge, nothing, panel, starter } from "../../elements/parts.js";
import { pageHead } from "../../pages.js";
import { mountJobBar } from "../calibration/jobbar.js";
import { mountPanTilt } from "../calibration/pantilt.js";
import { missingStations } from "../missing_stations.js";
import { resultOf, WHY } from "./result.js";
import { faultWords, findingsOf, hasNoMarkers, lackedMarkers, motionWords, verdictOf } from "./words.js";
import { waiting } from "../../elements/waiting.js";

/**
 * @import { AcceptanceDocument } from "#api"
 * @import { Store } from "#console"
 * @typedef {{
 *   store: Store, orders: import("../calibration/orders.js").CalibrationOrders,
 *   reader: import("../calibration/reader.js").CalibrationReader, work: import("../calibration/work.js").WorkFollower
 * }} AcceptanceContext
 * @typedef {{run: AcceptanceDocument | undefined, newest: boolean, simulated: boolean, loaded: boolean}} Shown
 */

/** @param {HTMLElement} place @param {AcceptanceContext} context */
export function mountAcceptancePage(place, context) {
  fill(
    place,
    pageHead(
      "acceptance-title",
      "Acceptance",
      html`<a class="plain" href=${wizardAddress("overview")}>${icon("scope")}Calibration</a>`,
    ),
    jobBar(context),
    html`<div class="wizard-body">
      <div class="wizard-step">${panel("Measure", ...starting(context))}${results(context)}</div>
      <aside class="wizard-side">${turner(context)}</aside>
    </div>`,
  );
}

/** Build the bar of the running procedure; a run that has ended shows as its result. @param {AcceptanceContext} context */
function jobBar(context) {
  const bar = h("div", { class: "jobbar" });
  mountJobBar(bar, context);
  context.store.on(["work"], ({ work }) => {
    bar.hidden = work?.step === "acceptance" && work.state === "succeeded";
  });
  return bar;
}

/** Build what a run does and the button that starts it. @param {AcceptanceContext} context */
function starting({ store, orders }) {
  const motion = h("p", { class: "lead" });
  const hint = h("div", {});
  store.on(["pan_tilt", "rig", "acceptances"], ({ pan_tilt, rig, acceptances }) => {
    setText(motion, motionWords(pan_tilt));
    const hinted = hasNoMarkers(pan_tilt) && !lackedMarkers(acceptances?.[0]); // else the result says so
    update(hint, hinted && missingStations({ simulated: rig?.simulated ?? false, why: WHY }, orders));
  });
  const start = starter({
    label: "Run the acceptance",
    store,
    act: () => orders.runAcceptance(),
    primary: true,
    picture: "play",
  });
  return [
    html`<p class="lead">
      The rig turns to its markers and measures itself: cameras, mirrors, triggers, timing, sensors, repeatability and
      distances. It takes two to ten minutes and changes no calibration.
    </p>`,
    motion,
    hint,
    html`<p class="actions">${start}</p>`,
  ];
}

/** Build the result and the list of all runs, from which another one is chosen. @param {AcceptanceContext} context */
function results({ store, orders }) {
  const [result, list] = [h("div", {}), h("div", {})];
  /** @type {{id: string | null, newest: string | undefined}} `id`: of the chosen run, null for the newest */
  const chosen = { id: null, newest: undefined };
  const showResult = changing(result, (/** @type {Shown} */ shown) => resultOrNone(shown, orders));
  const show = () => {
    const { acceptances, rig } = store.state;
    const newest = acceptances?.[0];
    if (newest?.id !== chosen.newest) Object.assign(chosen, { id: null, newest: newest?.id });
    const run = acceptances?.find(({ id }) => id === chosen.id) ?? newest;
    showResult({ run, newest: run === newest, simulated: rig?.simulated ?? false, loaded: acceptances !== null });
    update(list, acceptances && acceptances.length > 1 && panel("All runs", runList(acceptances, run, choose)));
  };
  const choose = (/** @type {string} */ id) => {
    chosen.id = id;
    show();
    result.querySelector(".verdict")?.scrollIntoView({ block: "center" });
  };
  store.on(["acceptances", "rig"], show);
  return [result, list];
}

/** @param {Shown} shown @param {AcceptanceContext["orders"]} orders */
function resultOrNone({ run, newest, simulated, loaded }, orders) {
  if (run) return resultOf({ run, newest, simulated }, orders);
  const none = nothing("Never run yet. Run it on a new rig, and after each move of the rig.");
  return panel("Result", loaded ? none : waiting("Loading the results"));
}

/**
 * @param {AcceptanceDocument[]} runs
 * @param {AcceptanceDocument | undefined} shown
 * @param {(id: string) => void} choose
 */
function runList(runs, shown, choose) {
  return html`<ul class="runs stack">${runs.map((run) => {
    const { tone, text } = verdictOf(run);
    return html`<li>
      <button
        type="button" class="plain alternative" aria-pressed=${String(run === shown)} @click=${() => choose(run.id)}
      >
        <time datetime=${run.created_utc}>${dayTime(run.created_utc)}</time>
        ${badge(tone, text)}<span class="why">${faultWords(findingsOf(run).length)}</span>
      </button>
    </li>`;
  })}</ul>`;
}

/** Build the panel of the pan-tilt, where there is one. @param {AcceptanceContext} context */
function turner(context) {
  const inside = h("div", { class: "inside" });
  mountPanTilt(inside, context);
  const element = h(
    "section",
    { class: "panel", "aria-label": "Pan-tilt" },
    html`<header><h3>Pan-tilt</h3></header>`,
    inside,
  );
  context.store.on(["pan_tilt"], ({ pan_tilt }) => {
    element.hidden = !pan_tilt?.present;
  });
  return element;
}
