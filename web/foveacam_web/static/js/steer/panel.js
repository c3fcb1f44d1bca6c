// The panel “Steer by hand”: a pad of volts for each eye, with a calibration one of directions for both, and what steers.

import { makeSteerDistance } from "../panels/dialogs.js";
import { badge } from "../parts.js";
import { fill, h, html, say, update } from "../dom.js";
import { sentence } from "../format.js";
import { SteerPad } from "./pad.js";
import { GAZE_MOST_DEG, pointOf, statusWords, voltsFor } from "./words.js";

/**
 * @import { ConsoleState, Point } from "#page"
 * @import { RigOrders } from "../rig/orders.js"
 * @import { Store } from "../store.js"
 * @import { Steering } from "./steering.js"
 * @typedef {{store: Store, orders: RigOrders, steering: Steering}} Context
 */

const EYES = /** @type {const} */ (["left", "right"]);
const GAMEPAD = {
  none: "Gamepad: none. Plug one in and press one of its buttons.",
  there:
    "Gamepad: hold A or a shoulder button; the left stick steers both eyes, or the left one, the right stick the right one.",
  lost: "The gamepad has gone while it steered: the mirrors hold, and are parked. Plug it in, and press again.",
};

/** @param {HTMLElement} place @param {Context} context */
export function mountSteering(place, { store, orders, steering }) {
  const [status, refused] = [
    h("p", { class: "steer-status", role: "status" }),
    h("p", { class: "refused", role: "alert" }),
  ];
  const gamepad = h("p", { class: "aside-note" });
  const gaze = gazePad(steering);
  const eyes = EYES.map((eye) => ({ eye, pad: voltsPad(eye, store, steering) }));
  const distance = makeSteerDistance(store, "steer-distance-panel");
  const aims = h("div", { class: "steer-aims" }, distance, shiftSlider(store));
  const park = h("button", {
    type: "button",
    class: "plain",
    text: "Park",
    title: "Both mirrors to rest",
    on: { click: () => void orders.park() },
  });
  fill(
    place,
    html`<div class="steer-head">${status}${modes(store)}${park}</div>`,
    refused,
    h(
      "div",
      { class: "steer-pads" },
      gaze.element,
      eyes.map(({ pad }) => pad.element),
    ),
    aims,
    gamepad,
  );
  aims.addEventListener("change", () => {
    const at = store.state.steering?.gaze;
    if (at && gazed(store.state)) steering.go({ gaze: steering.gazeAt(at) });
  });
  store.on(
    ["steering", "steer_limits", "steer_split", "steer_refusal", "rig", "rig_page", "stop", "gamepad"],
    (state) => {
      if (!state.rig_page) return;
      const { steering: now, steer_limits: limits } = state;
      const open = Boolean(limits && state.rig?.mirrors.connected && !state.stop?.engaged);
      const { tone, text } = state.stop?.engaged
        ? { tone: "warn", text: "The stop is engaged." }
        : statusWords(now, limits);
      update(status, badge(tone, text));
      say(refused, sentence(state.steer_refusal));
      say(gamepad, GAMEPAD[state.gamepad ?? "none"]);
      gaze.element.hidden = aims.hidden = !gazed(state);
      const looks = now?.gaze ? { x: now.gaze.ax_deg, y: now.gaze.ay_deg } : null;
      gaze.show({ most: GAZE_MOST_DEG, now: looks, target: null, open });
      for (const { eye, pad } of eyes) {
        const at = now?.pose ? pointOf(now.pose[eye]) : null;
        const target = now?.target && now.status !== "ended" ? pointOf(now.target[eye]) : null;
        pad.show({ most: limits?.max_v ?? 1, now: at, target, open });
      }
    },
  );
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
    h("button", { type: "button", class: "plain", text, on: { click: () => store.set({ steer_split: split }) } });
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
    say(text, `${steer_shift_deg.toFixed(2)}°`.replace("-", "−"));
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
