// Shows how the foveae's settings differ; blocks changes until the operator chooses whose settings apply to both.

import { changing, h } from "../dom.js";
import { sentence } from "../format.js";
import { icon } from "../icons.js";
import { settable, SETTINGS, settingText } from "./words.js";

/**
 * @import { CameraPatch, DifferenceDocument } from "#api"
 * @import { Store } from "../store.js"
 * @import { RigOrders } from "./orders.js"
 */

/** @type {Readonly<Record<"left" | "right", "left" | "right">>} */
const OTHER = Object.freeze({ left: "right", right: "left" });

/**
 * @param {HTMLElement} place
 * @param {{store: Store, orders: RigOrders}} context
 */
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
    h("button", {
      type: "button",
      class: "plain primary",
      data: { keep: `use-${eye}` },
      on: { click: () => void use(eye) },
      text: `Use ${eye}'s`,
    });
  return [
    h(
      "div",
      { class: "apart", role: "alertdialog", "aria-labelledby": "apart-title", "aria-describedby": "apart-why" },
      h("p", { class: "state warn", id: "apart-title" }, icon("warn"), "The foveae differ"),
      h("p", {
        id: "apart-why",
        class: "lead",
        text: "One pulse exposes both, and their pictures are compared: they must run alike. Nothing is changed on either until you say whose settings count.",
      }),
      h(
        "table",
        { class: "compare" },
        h(
          "thead",
          {},
          h(
            "tr",
            {},
            ["", "Left", "Right"].map((text) => h("th", { scope: "col", text })),
          ),
        ),
        h(
          "tbody",
          {},
          differences.map(({ setting, left, right }) =>
            h(
              "tr",
              {},
              h("th", { scope: "row", text: SETTINGS[setting].name }),
              h("td", { class: "eye-left", text: settingText(setting, left) }),
              h("td", { class: "eye-right", text: settingText(setting, right) }),
            ),
          ),
        ),
      ),
      refusal && h("p", { class: "refused", role: "alert", text: sentence(refusal) }),
      h("div", { class: "actions" }, button("left"), button("right")),
    ),
  ];
}

/** @param {DifferenceDocument | null} trigger */
function triggers(trigger) {
  if (!trigger) return [];
  return [
    h("p", { class: "state warn" }, icon("warn"), "Only one fovea waits for the trigger"),
    h("p", {
      class: "lead",
      text: `Left: ${settingText("trigger", trigger.left)}; right: ${settingText("trigger", trigger.right)}. The trigger is set in the rig file; test both triggers below.`,
    }),
  ];
}
