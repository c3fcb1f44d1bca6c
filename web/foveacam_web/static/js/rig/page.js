// Builds the rig page: cameras, trigger, controller, rail and pan-tilt. The console's live panes move here while it is
// open, with clicks disabled, and move back afterwards.

import { addressOf } from "../calibration/route.js";
import { mountPanTilt } from "../calibration/pantilt.js";
import { panel } from "../calibration/parts.js";
import { fill, focusOn, h, html, need, say } from "../dom.js";
import { icon } from "../icons.js";
import { makeCamera } from "./camera.js";
import { mountController } from "./controller.js";
import { mountFaults } from "./faults.js";
import { mountPair } from "./pair.js";
import { mountRail } from "./rail.js";
import { mountTrigger } from "./trigger.js";

/**
 * @import { Role } from "#page"
 * @import { Store } from "../store.js"
 * @import { Views } from "../video/views.js"
 * @typedef {{
 *   store: Store, views: Views, rig_orders: import("./orders.js").RigOrders, orders: import("../calibration/orders.js").CalibrationOrders
 * }} RigContext
 */

/** @type {Role[]} */
const ROLES = ["wide", "left", "right"];

/**
 * @param {HTMLElement} place
 * @param {RigContext} context
 */
export function mountRigPage(place, { store, views, rig_orders, orders }) {
  const context = { store, orders: rig_orders };
  const cameras = new Map(ROLES.map((role) => [role, makeCamera(role, context)]));
  const [apart, trigger, controller, turner, rail, faults] = [
    h("div", { class: "panel apart-place", hidden: true }),
    inside(),
    inside(),
    inside(),
    inside(),
    inside(),
  ];
  mountPair(apart, context);
  mountTrigger(trigger, context);
  mountController(controller, context);
  mountPanTilt(turner, { store, orders });
  mountRail(rail, context);
  fill(
    place,
    head(store),
    html`<div class="rig-cameras">${apart}${[...cameras.values()].map(({ element }) => element)}</div>`,
    html`<div class="rig-devices">
      <div class="column">${panel("Trigger", trigger)}${panel("Faults", faults)}</div>
      ${panel("Controller", controller)}
      <div class="column">${panel("Pan-tilt", turner)}${panel("Rail", rail)}</div>
    </div>`,
  );
  mountFaults(faults, context);
  store.on(["rig_page"], ({ rig_page, wizard }) => {
    if (rig_page) lend(views, cameras);
    else if (wizard === null) takeHome(views);
    turnPage(place, { open: rig_page, other: wizard !== null });
  });
}

function inside() {
  return h("div", { class: "stack" });
}

/** @param {Store} store */
function head(store) {
  const name = h("span", { class: "lead" });
  store.on(["rig"], ({ rig }) => say(name, rig ? [rig.name, rig.rig_id].filter(Boolean).join(" · ") : ""));
  return html`<div class="wizard-head">
    <h2 id="rig-page-title" tabindex="-1">Rig</h2>
    ${name}
    <a class="plain back" href=${addressOf(null)} aria-label="Back to the console">
      ${icon("back")}
      <span>Console</span>
    </a>
  </div>`;
}

/**
 * @param {Views} views
 * @param {Map<Role, {place: HTMLElement}>} cameras
 */
function lend(views, cameras) {
  for (const [role, { place }] of cameras) {
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
 * @param {{open: boolean, other: boolean}} now `other`: whether another page is over the console
 */
function turnPage(place, { open, other }) {
  if (open === !place.hidden) return;
  place.hidden = !open;
  need("console").hidden = open || other;
  window.scrollTo(0, 0);
  if (open || !other) focusOn(need(open ? "rig-page-title" : "console"));
}
