// Sets the faults of a simulated rig: cables, cameras, mirrors, and mounts knocked out of alignment.

import { changing, fill, h, html } from "../../elements/dom.js";
import { textButton } from "../../elements/parts.js";

/**
 * @import { MountKnock, SimulatedFaults } from "#api"
 * @import { Role, Store } from "#console"
 * @import { RigOrders } from "./orders.js"
 * @typedef {{name: string, list: "unplugged" | "frozen" | "no_trigger" | "no_strobe" | "dead_axes", axis?: "x" | "y", roles: Role[]}} Row
 */

/** @type {Role[]} */
const EYES = ["left", "right"];
/** @type {Role[]} */
const CAMERAS = ["wide", ...EYES];
/** @type {readonly Row[]} */
const ROWS = Object.freeze([
  { name: "Camera unplugged", list: "unplugged", roles: CAMERAS },
  { name: "Picture frozen", list: "frozen", roles: CAMERAS },
  { name: "Trigger cable off", list: "no_trigger", roles: EYES },
  { name: "Strobe cable off", list: "no_strobe", roles: EYES },
  { name: "Mirror x axis dead", list: "dead_axes", axis: "x", roles: EYES },
  { name: "Mirror y axis dead", list: "dead_axes", axis: "y", roles: EYES },
]);
/** @type {readonly {name: string, key: keyof MountKnock}[]} */
const SHIFTS = Object.freeze([
  { name: "Knocked right, °", key: "shift_x_deg" },
  { name: "Knocked down, °", key: "shift_y_deg" },
  { name: "Rolled, °", key: "rotation_deg" },
]);
const FARTHEST_DEG = 5;
const CARRIED_DEG = 0.3; // a rig that was moved: Sec. 3.3
const ROLLED_DEG = 0.1;

/**
 * @param {HTMLElement} place the content of its panel, which is hidden for a real rig
 * @param {{store: Store, orders: RigOrders}} context
 */
export function mountFaults(place, { store, orders }) {
  const table = h("div", { class: "scroll-x" });
  const put = (/** @type {Partial<SimulatedFaults>} */ part) =>
    store.state.faults && void orders.breakIt({ ...store.state.faults, ...part });
  const knock = textButton("Knock both mounts", () => put({ knocked_left: carried(), knocked_right: carried() }));
  const mend = textButton("Mend everything", () => orders.mend(), { picture: "again" });
  fill(
    place,
    html`<p class="lead">This rig is simulated: inject a fault and see how the server reports it.</p>`,
    table,
    html`<p class="actions">${knock}${mend}</p>`,
    html`<p class="aside-note">
      A knock turns each mount by 0.3° and rolls it by 0.1°, as if the rig had been carried. After some fixations on
      textured targets the calibration’s health reports it, and “Measure and correct” on the calibration page measures
      it; the angle between the eyes only if a distance is known.
    </p>`,
  );
  const show = changing(table, (/** @type {SimulatedFaults} */ faults) => [tableOf(faults, put)]);
  store.on(["faults", "rig", "rig_page"], ({ faults, rig, rig_page }) => {
    const whole = place.closest(".panel");
    if (whole instanceof HTMLElement) whole.hidden = !rig?.simulated || !faults;
    if (rig_page && faults) show(faults);
  });
}

/** Return a rotation of 0.3° in a random direction, and a roll to either side. */
function carried() {
  const heading = 2 * Math.PI * Math.random();
  const shift = (/** @type {number} */ part) => Number((CARRIED_DEG * part).toFixed(3));
  return {
    shift_x_deg: shift(Math.cos(heading)),
    shift_y_deg: shift(Math.sin(heading)),
    rotation_deg: Math.random() < 0.5 ? -ROLLED_DEG : ROLLED_DEG,
  };
}

/** @param {SimulatedFaults} faults @param {(part: Partial<SimulatedFaults>) => unknown} put */
function tableOf(faults, put) {
  return html`<table class="compare faults">
    <thead><tr>${["", "Wide", "Left", "Right"].map((text) => html`<th scope="col">${text}</th>`)}</tr></thead>
    <tbody>
      ${ROWS.map((row) => tickRow(row, faults, put))}
      ${SHIFTS.map((shift) => shiftRow(shift, faults, put))}
    </tbody>
  </table>`;
}

/** @param {Row} row @param {SimulatedFaults} faults @param {(part: Partial<SimulatedFaults>) => unknown} put */
function tickRow({ name, list, axis, roles }, faults, put) {
  const broken = /** @type {string[]} */ (faults[list]);
  const cell = (/** @type {Role} */ role) => {
    if (!roles.includes(role)) return html`<td></td>`;
    const what = axis ? `${role} ${axis}` : role;
    const changed = (/** @type {Event} */ event) => {
      const input = /** @type {HTMLInputElement} */ (event.currentTarget);
      const others = broken.filter((other) => other !== what);
      put({ [list]: input.checked ? [...others, what] : others });
      input.checked = broken.includes(what); // until the server confirms it
    };
    return html`<td>
      <label class="cell">
        <input type="checkbox" .checked=${broken.includes(what)} aria-label="${name}: ${role}" @change=${changed} />
      </label>
    </td>`;
  };
  return html`<tr><th scope="row">${name}</th>${CAMERAS.map(cell)}</tr>`;
}

/**
 * @param {{name: string, key: keyof MountKnock}} shift
 * @param {SimulatedFaults} faults
 * @param {(part: Partial<SimulatedFaults>) => unknown} put
 */
function shiftRow({ name, key }, faults, put) {
  const cell = (/** @type {"left" | "right"} */ eye) => {
    const knocked = faults[`knocked_${eye}`];
    const changed = (/** @type {Event} */ event) => {
      const input = /** @type {HTMLInputElement} */ (event.currentTarget);
      if (!input.reportValidity()) return;
      put({
        [`knocked_${eye}`]: { ...knocked, [key]: Number.isFinite(input.valueAsNumber) ? input.valueAsNumber : 0 },
      });
      input.value = String(knocked[key]);
    };
    return html`<td>
      <input
        type="number" step="any" min=${-FARTHEST_DEG} max=${FARTHEST_DEG} .value=${String(knocked[key])} inputmode="decimal"
        aria-label="${name}: ${eye}" @change=${changed}
      />
    </td>`;
  };
  return html`<tr><th scope="row">${name}</th><td></td>${cell("left")}${cell("right")}</tr>`;
}
