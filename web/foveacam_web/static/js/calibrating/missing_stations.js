// What is missing where no station with markers exists, how to get one, and a button where the simulation has one.

import { SETUP_ADDRESS } from "../addresses.js";
import { ask } from "../elements/ask.js";
import { html } from "../elements/dom.js";
import { icon } from "../elements/icons.js";
import { textButton } from "../elements/parts.js";

/** @import { CalibrationOrders } from "./calibration/orders.js" */

/** The simulated room with boards, markers and a pan-tilt's stations before them. */
const SCENE = "calibration";
const OPENING = Object.freeze({
  title: "Open the calibration scene",
  text: "The simulated rig is parked and opened again in a room with boards and markers.",
  yes: "Open it",
});

/**
 * Say what is missing, and how it is got.
 * @param {{simulated: boolean, why: string}} missing `why`: what cannot be done without, a sentence
 * @param {CalibrationOrders} orders
 */
export function missingStations({ simulated, why }, orders) {
  const open = async () => {
    if (await ask(OPENING)) await orders.openScene(SCENE);
  };
  const way = simulated
    ? html`<p class="remedy">The simulation has them in another scene.</p>
        <p class="actions">${textButton("Open the calibration scene", open, { kind: "plain primary", picture: "cube" })}</p>`
    : html`<p class="remedy">
        Name one in the rig file: where to point, and how far away the markers are.
        ${" "}<a href=${SETUP_ADDRESS}>Set the rig up.</a>
      </p>`;
  return html`<div class="strip warn damage">
    ${icon("warn")}
    <div class="stack"><p>This rig has no station with markers. ${why}</p>${way}</div>
  </div>`;
}
