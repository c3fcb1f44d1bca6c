// Controls the rail: its position, moving to a named place or a position, homing, stopping.

import { keptButton, nothing, numberField, textButton } from "../../elements/parts.js";
import { isRunning } from "../../calibrating/calibration/state.js";
import { changing, fill, h, html, setText } from "../../elements/dom.js";
import { number, sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { nextStep, stateWord } from "./positioner_words.js";
import { zeroOf } from "./zero.js";

/**
 * @import { RailDocument } from "#api"
 * @import { Store } from "#console"
 * @import { RigOrders } from "./orders.js"
 */

/** @param {HTMLElement} place @param {{store: Store, orders: RigOrders}} context */
export function mountRail(place, { store, orders }) {
  const [state, places] = [h("div", { class: "stack" }), h("div", { class: "stations" })];
  const drive = driveOf(orders);
  const zero = zeroOf("rail", () => void orders.confirmRailZero());
  fill(place, state, zero.element, drive.element, places);
  const showState = changing(state, stateOf);
  const showPlaces = changing(places, (/** @type {{rail: RailDocument | null, busy: boolean}} */ now) =>
    placesOf(now, orders),
  );
  store.on(["rail", "work", "rig_page"], ({ rail, work, rig_page }) => {
    if (!rig_page) return;
    const busy = isRunning(work);
    showState(rail);
    zero.update(rail, busy);
    drive.update(rail, busy);
    showPlaces({ rail: rail && { ...rail, position_mm: null, moving: false }, busy });
  });
}

/** @param {RailDocument | null} rail */
function stateOf(rail) {
  if (!rail) return [nothing("The rail has not answered yet.")];
  if (!rail.present)
    return [
      html`<p class="lead">This rig has no rail.</p>`,
      html`<p class="remedy">Name one, or “manual”, in the rig's file to move it sideways from here.</p>`,
    ];
  if (rail.fault)
    return [
      html`<p class="state bad">${icon("warn")}Rail not usable</p>`,
      html`<p class="lead">${sentence(rail.fault)}</p>`,
    ];
  if (!rail.moves_itself) return byHand(rail);
  const tone = !rail.connected ? "bad" : rail.homed || rail.moving ? "good" : "";
  const reach = rail.limits ? `; reaches ${number(rail.limits.min_mm, 0)} … ${number(rail.limits.max_mm, 0)} mm` : "";
  return [
    html`<p class="pose number">
      <span class="lamp ${tone}"></span>
      ${rail.position_mm === null ? "position unknown" : `${number(rail.position_mm, 1)} mm`}
    </p>`,
    html`<p class="lead">${stateWord(rail, "moving")}${reach}</p>`,
  ];
}

/** @param {RailDocument} rail */
function byHand({ wanted_mm, position_mm }) {
  return [
    html`<p class="state warn">${icon("hand")}You push the rig</p>`,
    wanted_mm === null
      ? html`<p class="lead">Choose a place: the position to push the rig to appears here.</p>`
      : html`<p class="order" role="status">Push the rig to ${number(wanted_mm, 1)} mm.</p>`,
    position_mm !== null && html`<p class="why">Last confirmed position: ${number(position_mm, 1)} mm.</p>`,
  ];
}

/** @param {RigOrders} orders */
function driveOf(orders) {
  const to = numberField("Position", { unit: "mm", step: "any" });
  const go = h("button", { type: "submit", class: "plain" }, "Go");
  const hold = keptButton("Hold", () => orders.holdRail(), {
    kind: "plain hold",
    name: "Hold the rail",
    title: "Stop moving now",
  });
  const home = keptButton("Home", () => orders.homeRail(), { name: "Home the rail" });
  const reason = h("p", { class: "why", role: "status" });
  const send = (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    const position_mm = to.value();
    if (position_mm !== null) void orders.slide({ position_mm });
  };
  const element = h(
    "form",
    { class: "stack", novalidate: true, on: { submit: send } },
    html`<div class="actions">${to.element}${go}${home}${hold}</div>`,
    reason,
  );
  return {
    element,
    update: (/** @type {RailDocument | null} */ rail, /** @type {boolean} */ busy) => {
      element.hidden = !rail?.present || Boolean(rail.fault && !rail.connected);
      const ready = Boolean(rail?.connected && (rail.homed || !rail.moves_itself));
      go.disabled = to.input.disabled = busy || !ready;
      home.hidden = !rail?.moves_itself || rail.awaits_zero;
      hold.hidden = !rail?.moves_itself;
      home.disabled = busy || !rail?.connected;
      setText(
        reason,
        busy
          ? "The procedure needs the rig where it is."
          : !rail?.connected
            ? "The rail is not connected."
            : ready
              ? ""
              : nextStep(rail, "stands"),
      );
    },
  };
}

/** @param {{rail: RailDocument | null, busy: boolean}} now @param {RigOrders} orders */
function placesOf({ rail, busy }, orders) {
  if (!rail?.present || rail.places.length === 0) return [];
  const ready = rail.connected && (rail.homed || !rail.moves_itself) && !rail.fault && !busy;
  return [
    html`<h4>Places</h4>`,
    html`<ul>
      ${rail.places.map(
        ({ name, position_mm }) =>
          html`<li>
          <span class="name">${name}</span>
          <span class="where">${number(position_mm, 0)} mm</span>
          ${textButton("Go", () => orders.slide({ place: name }), {
            name: `Go to the place ${name}`,
            disabled: !ready,
          })}
        </li>`,
      )}
    </ul>`,
  ];
}
