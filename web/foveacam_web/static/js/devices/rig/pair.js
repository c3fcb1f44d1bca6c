// Shows how the foveae's settings differ; blocks changes until the operator chooses whose settings apply to both.

import { changing, html } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { settable, SETTINGS, settingText } from "./words.js";
import { textButton } from "../../elements/parts.js";

/**
 * @import { CameraPatch, DifferenceDocument } from "#api"
 * @import { Store } from "#console"
 * @import { RigOrders } from "./orders.js"
 */

/** @type {Readonly<Record<"left" | "right", "left" | "right">>} */
const OTHER = Object.freeze({ left: "right", right: "left" });

/** @param {HTMLElement} place @param {{store: Store, orders: RigOrders}} context */
export function mountPair(place, { store, orders }) {
  let refusal = "";
  const use = async (/** @type {"left" | "right"} */ eye) => {
    const patch = /** @type {CameraPatch} */ (
      Object.fromEntries(settable(store.state.rig).map((difference) => [difference.setting, difference[eye]]))
    );
    const answer = await orders.change(OTHER[eye], patch, false);
    refusal = answer.refusal
      ? `The ${OTHER[eye]} camera does not take the ${eye} one's settings: ${answer.refusal}`
      : "";
    store.set({ rig: store.state.rig });
  };
  const show = changing(
    place,
    (/** @type {{differences: DifferenceDocument[], trigger: DifferenceDocument | null, refusal: string}} */ now) => [
      ...question(now, use),
      ...triggers(now.trigger),
    ],
  );
  store.on(["rig", "rig_page"], (state) => {
    if (!state.rig_page) return;
    const differences = settable(state.rig);
    const trigger = state.rig?.divergence?.find(({ setting }) => setting === "trigger") ?? null;
    if (differences.length === 0) refusal = "";
    show({ differences, trigger, refusal });
    place.hidden = differences.length === 0 && !trigger;
  });
}

/**
 * @param {{differences: DifferenceDocument[], refusal: string}} now
 * @param {(eye: "left" | "right") => Promise<void>} use
 */
function question({ differences, refusal }, use) {
  if (differences.length === 0) return [];
  const button = (/** @type {"left" | "right"} */ eye) =>
    textButton(`Use ${eye}'s`, () => use(eye), { kind: "plain primary" });
  return [
    html`<div class="apart" role="alertdialog" aria-labelledby="apart-title" aria-describedby="apart-why">
      <p class="state warn" id="apart-title">${icon("warn")}The foveae differ</p>
      <p id="apart-why" class="lead">
        One pulse exposes both, and their pictures are compared: they must run alike. Nothing is changed on either
        until you choose whose settings apply.
      </p>
      <table class="compare">
        <thead><tr>${["", "Left", "Right"].map((text) => html`<th scope="col">${text}</th>`)}</tr></thead>
        <tbody>
          ${differences.map(
            ({ setting, left, right }) =>
              html`<tr>
              <th scope="row">${SETTINGS[setting].name}</th>
              <td class="eye-left">${settingText(setting, left)}</td>
              <td class="eye-right">${settingText(setting, right)}</td>
            </tr>`,
          )}
        </tbody>
      </table>
      ${refusal && html`<p class="refused" role="alert">${sentence(refusal)}</p>`}
      <div class="actions">${button("left")}${button("right")}</div>
    </div>`,
  ];
}

/** @param {DifferenceDocument | null} trigger */
function triggers(trigger) {
  if (!trigger) return [];
  return [
    html`<p class="state warn">${icon("warn")}Only one fovea waits for the trigger</p>`,
    html`<p class="lead">
      Left: ${settingText("trigger", trigger.left)}; right: ${settingText("trigger", trigger.right)}. The trigger is
      set in the rig file; test both triggers below.
    </p>`,
  ];
}
