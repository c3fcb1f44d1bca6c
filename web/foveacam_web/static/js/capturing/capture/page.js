// Builds the capture page: the editor, the estimate, the wide view with footprints, running and unfinished captures.

import { GALLERY_ADDRESS } from "../../addresses.js";
import { panel } from "../../elements/parts.js";
import { fill, h, html } from "../../elements/dom.js";
import { icon } from "../../elements/icons.js";
import { pageHead } from "../../pages.js";
import { Bench } from "./bench.js";
import { mountFigures } from "./figures.js";
import { mountPartials } from "./partials.js";
import { PlanPrints } from "./prints.js";
import { mountRuns } from "./runs.js";
import { stillPanel } from "./still.js";
import { mountWarnings } from "./warnings.js";

/**
 * @import { Role, Store } from "#console"
 * @import { Slots } from "../../pages.js"
 * @import { Views } from "../../video/views.js"
 * @typedef {{
 *   store: Store, views: Views, commands: import("../../commands.js").Commands,
 *   capture_orders: import("./orders.js").CaptureOrders, capture_reader: import("./reader.js").CaptureReader,
 *   still_reader: import("./still_reader.js").StillReader
 * }} CaptureContext
 */

/** @type {Role[]} */
const ROLES = ["wide", "left", "right"];

/** @param {HTMLElement} place @param {CaptureContext} context @returns {Slots} */
export function mountCapturePage(place, context) {
  const { store, views, commands, capture_orders: orders, capture_reader: reader, still_reader } = context;
  const bench = new Bench({ store, commands, orders });
  const [runs, warnings, atStart, figures, partials] = [
    h("div", { class: "runs-bar" }),
    h("div", { class: "plan-warnings", role: "status" }),
    h("div", { class: "plan-warnings at-start", role: "status" }),
    h("div", { class: "stack figures" }),
    h("div", { class: "stack" }),
  ];
  const places = new Map(ROLES.map((role) => [role, h("div", { class: `lent lent-${role}` })]));
  mountRuns(runs, { store, orders, reader });
  mountFigures(figures, store);
  for (const place of [warnings, atStart])
    mountWarnings(place, { store, view: () => bench.view, change: (draft) => bench.change(draft) });
  mountPartials(partials, { store, orders });
  new PlanPrints(views.pane("wide"), store);
  reader.ended = () => bench.again();
  fill(
    place,
    pageHead(
      "capture-title",
      "Capture",
      html`<a class="plain to-gallery" href=${GALLERY_ADDRESS}>${icon("pictures")}Gallery</a>`,
    ),
    runs,
    html`<div class="capture-body">
      <div class="column capture-plan">${panel("Plan", bench.editor)}</div>
      <div class="column capture-see">
        ${places.get("wide") ?? null}
        ${legend()}
        ${warnings}
        <div class="capture-eyes">${places.get("left") ?? null}${places.get("right") ?? null}</div>
      </div>
      <div class="column capture-start">
        ${panel("What it takes", figures)}
        ${panel("Capture", html`${bench.starter}${atStart}`)}
        ${panel("Unfinished", partials)}
      </div>
      <div class="column capture-still">${stillPanel({ store, commands, reader: still_reader })}</div>
    </div>`,
  );
  store.on(["capture_page"], ({ capture_page }) => {
    if (!capture_page) return;
    views.wide.fit(); // the whole plan is seen
    bench.ask();
  });
  return places;
}

function legend() {
  return html`<p class="legend prints-legend">
    <span class="key left">left eye</span>
    <span class="key right">right eye</span>
    <span class="key both">both</span>
    <span class="key way">way of the mirrors</span>
  </p>`;
}
