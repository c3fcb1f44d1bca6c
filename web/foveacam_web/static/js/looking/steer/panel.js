// The panel “Steer by hand”: a pad of volts for each eye, with a calibration one of directions for both, and the gamepad.

import { makeSteerDistance } from "../../panels/dialogs.js";
import { badge, keptButton } from "../../elements/parts.js";
import { fill, h, html, setText, update } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { SteerPad } from "./pad.js";
import { GAZE_MOST_DEG, pointOf, statusWords, voltsFor } from "./words.js";

/**
 * @import { ConsoleState, EyePair, Point, Store, Volts } from "#console"
 * @import { RigOrders } from "../../devices/rig/orders.js"
 * @import { Steering } from "./steering.js"
 * @typedef {{store: Store, orders: RigOrders, steering: Steering}} Context
 */

const EYES = /** @type {const} */ (["left", "right"]);
const GAMEPAD = {
  none: "Gamepad: none. Plug one in and press one of its buttons.",
  there:
    "Gamepad: hold A or a shoulder button; the left stick steers both eyes, or the left one, the right stick the right one.",
  lost: "The gamepad was disconnected while steering: the mirrors hold, and are parked. Plug it in, and press again.",
};

/** What of the state the panel shows. @type {(keyof ConsoleState)[]} */
const SHOWN = ["steering", "steer_limits", "steer_split", "steer_refusal", "rig", "rig_page", "stop", "gamepad"];

/** @param {HTMLElement} place @param {Context} context */
export function mountSteering(place, { store, orders, steering }) {
  const [status, refused, gamepad] = [
    h("p", { class: "steer-status", role: "status" }),
    h("p", { class: "refused", role: "alert" }),
    h("p", { class: "aside-note" }),
  ];
  const pads = {
    gaze: gazePad(steering),
    left: voltsPad("left", store, steering),
    right: voltsPad("right", store, steering),
  };
  const aims = gazeAims(store, steering);
  fill(
    place,
    html`<div class="steer-head">${status}${modes(store)}${parkButton(orders)}</div>`,
    refused,
    h("div", { class: "steer-pads" }, pads.gaze.element, pads.left.element, pads.right.element),
    aims,
    gamepad,
  );
  store.on(SHOWN, (state) => {
    if (!state.rig_page) return;
    const { tone, text } = state.stop?.engaged
      ? { tone: "warn", text: "The stop is engaged." }
      : statusWords(state.steering, state.steer_limits);
    update(status, badge(tone, text));
    setText(refused, sentence(state.steer_refusal));
    setText(gamepad, GAMEPAD[state.gamepad ?? "none"]);
    pads.gaze.element.hidden = aims.hidden = !gazed(state);
    showPads(pads, state);
  });
}

/** @param {{gaze: SteerPad, left: SteerPad, right: SteerPad}} pads @param {ConsoleState} state */
function showPads(pads, { steering, steer_limits, rig, stop }) {
  const open = Boolean(steer_limits && rig?.mirrors.connected && !stop?.engaged);
  const { gaze, pose } = steering ?? { gaze: null, pose: null };
  const under_way = steering?.status === "steering" || steering?.status === "silent";
  const target = under_way ? steering.target : null;
  const looks = gaze ? { x: gaze.ax_deg, y: gaze.ay_deg } : null;
  pads.gaze.show({ most: GAZE_MOST_DEG, now: looks, target: null, open });
  for (const eye of EYES) {
    const place = (/** @type {EyePair<Volts> | null} */ volts) => (volts ? pointOf(volts[eye]) : null);
    pads[eye].show({ most: steer_limits?.max_v ?? 1, now: place(pose), target: place(target), open });
  }
}

/** Build the distance and the vertical shift of a gaze. @param {Store} store @param {Steering} steering */
function gazeAims(store, steering) {
  const aims = h("div", { class: "steer-aims" }, makeSteerDistance(store, "steer-distance-panel"), shiftSlider(store));
  aims.addEventListener("change", () => {
    const at = store.state.steering?.gaze;
    if (at && gazed(store.state)) steering.go({ gaze: steering.gazeAt(at) });
  });
  return aims;
}

/** @param {RigOrders} orders */
function parkButton(orders) {
  return keptButton("Park", () => orders.park(), { title: "Both mirrors to rest" });
}

/** Whether both eyes are steered by direction. @param {ConsoleState} state */
function gazed({ rig, steer_split }) {
  return Boolean(rig?.calibration) && !steer_split;
}

/** @param {Steering} steering */
function gazePad(steering) {
  const place = (/** @type {Point} */ { x, y }) => ({ gaze: steering.gazeAt({ ax_deg: x, ay_deg: y }) });
  return new SteerPad({
    name: "Both eyes",
    unit: "°",
    kind: "steer-both",
    step: 0.2,
    fine: 0.02,
    decimals: 2,
    steer: (to) => steering.hold(place(to)),
    release: () => steering.release(),
    go: (to) => steering.go(place(to)),
  });
}

/** With a calibration an eye's own pad splits the eyes. @param {"left" | "right"} eye @param {Store} store @param {Steering} steering */
function voltsPad(eye, store, steering) {
  const place = (/** @type {Point} */ to) => {
    const { rig, steer_split } = store.state;
    if (rig?.calibration && !steer_split) store.set({ steer_split: true });
    return { volts: voltsFor(eye, to, store.state.steer_split) };
  };
  return new SteerPad({
    name: eye === "left" ? "Left eye" : "Right eye",
    unit: "V",
    kind: `steer-${eye}`,
    step: 2,
    fine: 0.2,
    decimals: 1,
    steer: (to) => steering.hold(place(to)),
    release: () => steering.release(),
    go: (to) => steering.go(place(to)),
  });
}

/** @param {Store} store */
function modes(store) {
  const choice = (/** @type {string} */ text, /** @type {boolean} */ split) =>
    keptButton(text, () => store.set({ steer_split: split }));
  const [together, split] = [choice("Together", false), choice("Split", true)];
  together.title = "Both eyes move as one";
  split.title = "Each eye goes by its own pad";
  store.on(["steer_split"], ({ steer_split }) => {
    together.setAttribute("aria-pressed", String(!steer_split));
    split.setAttribute("aria-pressed", String(steer_split));
  });
  return h("div", { class: "steer-modes", role: "group", "aria-label": "How the eyes are steered" }, together, split);
}

/** @param {Store} store */
function shiftSlider(store) {
  const text = h("output", { class: "number", for: "steer-shift" });
  const slider = h("input", { type: "range", id: "steer-shift", min: "-0.5", max: "0.5", step: "0.01", value: "0" });
  slider.addEventListener("input", () => store.set({ steer_shift_deg: Number(slider.value) }));
  store.on(["steer_shift_deg"], ({ steer_shift_deg }) => {
    setText(text, `${steer_shift_deg.toFixed(2)}°`.replace("-", "−"));
    slider.setAttribute("aria-valuetext", `${steer_shift_deg.toFixed(2)}°, the left eye lower`);
  });
  return h(
    "div",
    { class: "steering", title: "The left eye looks lower by this, the right one higher" },
    html`<label for="steer-shift">Vertical shift</label>`,
    slider,
    text,
  );
}
