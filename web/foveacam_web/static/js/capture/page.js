// Builds the capture page: the editor, the estimate, the wide view with footprints, running and unfinished captures.
// The console's live panes move here while it is open, with clicks disabled, and move back afterwards.

import { addressOf } from "../calibration/route.js";
import { panel } from "../calibration/parts.js";
import { fill, focusOn, h, html, need } from "../dom.js";
import { icon } from "../icons.js";
import { Bench } from "./bench.js";
import { mountFigures } from "./figures.js";
import { mountPartials } from "./partials.js";
import { PlanPrints } from "./prints.js";
import { mountRuns } from "./runs.js";

/**
 * @import { Role } from "#page"
 * @import { Store } from "../store.js"
 * @import { Views } from "../video/views.js"
 * @typedef {{
 *   store: Store, views: Views, commands: import("../commands.js").Commands,
 *   capture_orders: import("./orders.js").CaptureOrders, capture_reader: import("./reader.js").CaptureReader
 * }} CaptureContext
 */

/** @type {Role[]} */
const ROLES = ["wide", "left", "right"];

/**
 * @param {HTMLElement} place
 * @param {CaptureContext} context
 */
export function mountCapturePage(place, { store, views, commands, capture_orders: orders, capture_reader: reader }) {
  const bench = new Bench({ store, commands, orders });
  const [runs, figures, partials] = [h("div", {}), h("div", { class: "stack figures" }), h("div", { class: "stack" })];
  const places = new Map(ROLES.map((role) => [role, h("div", { class: `lent lent-${role}` })]));
  mountRuns(runs, { store, orders, reader });
  mountFigures(figures, store);
  mountPartials(partials, { store, orders });
  new PlanPrints(views.pane("wide"), store);
  reader.ended = () => bench.again();
  fill(
    place,
    head(),
    runs,
    html`<div class="capture-body">
      <div class="column capture-plan">${panel("Plan", bench.editor)}</div>
      <div class="column capture-see">
        ${places.get("wide") ?? null}
        ${legend()}
        <div class="capture-eyes">${places.get("left") ?? null}${places.get("right") ?? null}</div>
      </div>
      <div class="column capture-start">
        ${panel("What it takes", figures)}
        ${panel("Capture", bench.starter)}
        ${panel("Unfinished", partials)}
      </div>
      <div id="still-capture" class="column capture-still"></div>
    </div>`,
  );
  store.on(["capture_page"], ({ capture_page, wizard, rig_page }) => {
    if (capture_page) lend(views, places);
    else if (wizard === null && !rig_page) takeHome(views);
    turnPage(place, capture_page);
    if (capture_page) bench.ask();
  });
}

function head() {
  return html`<div class="wizard-head">
    <h2 id="capture-title" tabindex="-1">Capture</h2>
    <a class="plain to-gallery" href="#/gallery">${icon("pictures")}Gallery</a>
    <a class="plain back" href=${addressOf(null)} aria-label="Back to the console">
      ${icon("back")}
      <span>Console</span>
    </a>
  </div>`;
}

function legend() {
  return html`<p class="legend prints-legend">
    <span class="key left">left eye</span>
    <span class="key right">right eye</span>
    <span class="key both">both</span>
    <span class="key way">way of the mirrors</span>
  </p>`;
}

/**
 * @param {Views} views
 * @param {Map<Role, HTMLElement>} places
 */
function lend(views, places) {
  for (const [role, place] of places) {
    const pane = views.pane(role);
    place.prepend(pane.element);
    pane.surface.inert = true; // a click here must not start a fixation
  }
}

/** @param {Views} views */
function takeHome(views) {
  need("wide").prepend(views.pane("wide").element);
  need("eyes").prepend(views.pane("left").element, views.pane("right").element);
  for (const role of ROLES) views.pane(role).surface.inert = false;
}

/**
 * Show or hide the page, and move the focus to what is then visible.
 * @param {HTMLElement} place
 * @param {boolean} open
 */
function turnPage(place, open) {
  if (open === !place.hidden) return;
  place.hidden = !open;
  const other = document.querySelector(".wizard:not([hidden])") !== null; // another page is open already
  need("console").hidden = open || other;
  if (open) window.scrollTo(0, 0);
  if (open || !other) focusOn(need(open ? "capture-title" : "console"));
}
