// Builds the rig page in tabs: cameras; mirrors with trigger and controller; pan-tilt and rail; faults.

import { mountPanTilt } from "../../calibrating/calibration/pantilt.js";
import { ENGINE_ADDRESS, RIG_TABS, rigAddress, RIGS_ADDRESS, SETUP_ADDRESS } from "../../addresses.js";
import { icon } from "../../elements/icons.js";
import { panel } from "../../elements/parts.js";
import { absent, fill, h, html, setText, update } from "../../elements/dom.js";
import { pageHead } from "../../pages.js";
import { mountBinning } from "./binning.js";
import { makeCamera } from "./camera.js";
import { mountController } from "./controller.js";
import { mountFaults } from "./faults.js";
import { mountPair } from "./pair.js";
import { mountRail } from "./rail.js";
import { mountSteering } from "../../looking/steer/panel.js";
import { mountTrigger } from "./trigger.js";

/**
 * @import { Role, Store } from "#console"
 * @import { Slots } from "../../pages.js"
 * @typedef {{
 *   store: Store, rig_orders: import("./orders.js").RigOrders, orders: import("../../calibrating/calibration/orders.js").CalibrationOrders,
 *   steering: import("../../looking/steer/steering.js").Steering
 * }} RigContext
 */

/** @type {Role[]} */
const ROLES = ["wide", "left", "right"];

/** @param {HTMLElement} place @param {RigContext} context @returns {Slots} */
export function mountRigPage(place, { store, rig_orders, orders, steering }) {
  const context = { store, orders: rig_orders };
  const cameras = new Map(ROLES.map((role) => [role, makeCamera(role, context)]));
  const [apart, binning, trigger, controller, turner, rail, faults] = [
    h("div", { class: "panel apart-place", hidden: true }),
    inside(),
    inside(),
    inside(),
    inside(),
    inside(),
    inside(),
  ];
  const steer = inside();
  mountSteering(steer, { ...context, steering });
  mountPair(apart, context);
  mountBinning(binning, context);
  mountTrigger(trigger, context);
  mountController(controller, context);
  mountPanTilt(turner, { store, orders });
  mountRail(rail, context);
  fill(
    place,
    head(store),
    tabsOf(store),
    html`<div data-tab="cameras">
      <div class="rig-cameras">${apart}${[...cameras.values()].map(({ element }) => element)}</div>
      <div class="rig-devices">${panel("Working binning", binning)}</div>
    </div>`,
    html`<div data-tab="mirrors">
      <div class="rig-steer">${panel("Steer by hand", steer)}</div>
      <div class="rig-devices">${panel("Trigger", trigger)}${panel("Controller", controller)}</div>
    </div>`,
    html`<div class="rig-devices" data-tab="positioners">${panel("Pan-tilt", turner)}${panel("Rail", rail)}</div>`,
    html`<div class="rig-devices" data-tab="faults">${panel("Faults", faults)}</div>`,
  );
  store.on(["rig_page"], ({ rig_page }) => {
    for (const each of place.querySelectorAll("[data-tab]"))
      if (each instanceof HTMLElement) each.hidden = each.dataset["tab"] !== (rig_page ?? "cameras");
  });
  mountFaults(faults, context);
  return new Map([...cameras].map(([role, { place: slot }]) => [role, slot]));
}

/** Build the links to the parts of the page. @param {Store} store */
function tabsOf(store) {
  const nav = h("nav", { class: "wizard-tabs rig-tabs", "aria-label": "Parts of the rig" });
  store.on(["rig_page", "rig"], ({ rig_page, rig }) =>
    update(
      nav,
      RIG_TABS.filter(({ tab }) => tab !== "faults" || rig?.simulated).map(
        ({ tab, title }) =>
          html`<a href=${rigAddress(tab)} aria-current=${tab === rig_page ? "page" : absent}><span>${title}</span></a>`,
      ),
    ),
  );
  return nav;
}

function inside() {
  return h("div", { class: "stack" });
}

/** @param {Store} store */
function head(store) {
  const name = h("span", { class: "lead" });
  store.on(["rig"], ({ rig }) => setText(name, rig ? [rig.name, rig.rig_id].filter(Boolean).join(" · ") : ""));
  return pageHead(
    "rig-page-title",
    "Rig",
    name,
    html`<a class="plain to-setup" href=${SETUP_ADDRESS}>${icon("gear")}Set up</a>`,
    html`<a class="plain" href=${ENGINE_ADDRESS}>${icon("scope")}Engine</a>`,
    html`<a class="plain" href=${RIGS_ADDRESS}>${icon("columns")}All rigs</a>`,
  );
}
