// Lists the targets: shows, edits and removes each by keyboard, as the drawing does by pointer.

import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { HUES } from "./drawing.js";

/**
 * @import { MapPoint } from "#page"
 * @typedef {{move: (index: number, place: MapPoint) => void, remove: (index: number) => void, add: () => void, reset: () => void}} Orders
 */

/** @param {Orders} orders */
export function makeTargets(orders) {
  const list = h("ol", { class: "plan-targets" });
  const reset = h(
    "button",
    { type: "button", class: "plain", on: { click: () => orders.reset() } },
    icon("again"),
    "The map’s own",
  );
  const empty = h("p", { class: "empty", text: "No target yet: click on the plan, or add one." });
  /** @type {{inputs: HTMLInputElement[]}[]} */
  let rows = [];
  const element = h(
    "div",
    { class: "stack" },
    empty,
    list,
    h(
      "p",
      { class: "actions" },
      h("button", { type: "button", class: "plain", on: { click: () => orders.add() } }, icon("plus"), "Add a target"),
      reset,
    ),
  );
  const rebuild = (/** @type {number} */ length) => {
    rows = Array.from({ length }, (_, index) => row(index));
    fill(
      list,
      ...rows.map(({ inputs }, index) =>
        h(
          "li",
          { class: `hue-${index % HUES}` },
          h("span", { class: "mark", "aria-hidden": "true", text: String(index) }),
          inputs.map((input, axis) => h("label", {}, h("span", { text: axis === 0 ? "x" : "y" }), input)),
          h("span", { class: "unit", text: "m" }),
          h(
            "button",
            {
              type: "button",
              class: "tool",
              "aria-label": `Remove target ${index}`,
              title: `Remove target ${index}`,
              on: { click: () => orders.remove(index) },
            },
            icon("trash"),
          ),
        ),
      ),
    );
  };
  const row = (/** @type {number} */ index) => {
    const typed = () => {
      const place = inputs.map((input) => input.valueAsNumber);
      if (place.every(Number.isFinite)) orders.move(index, /** @type {MapPoint} */ (place));
    };
    const inputs = ["x", "y"].map((axis) =>
      h("input", {
        type: "number",
        step: "any",
        inputmode: "decimal",
        "aria-label": `${axis} of target ${index}, m`,
        on: { input: typed },
      }),
    );
    return { inputs };
  };
  return {
    element,
    show: (/** @type {MapPoint[]} */ targets_m, /** @type {boolean} */ own) => {
      if (rows.length !== targets_m.length) rebuild(targets_m.length);
      targets_m.forEach((place, index) =>
        rows[index]?.inputs.forEach((input, axis) => {
          const value = Number((place[axis] ?? 0).toFixed(2));
          if (document.activeElement !== input && input.valueAsNumber !== value) input.value = String(value);
        }),
      );
      empty.hidden = targets_m.length > 0;
      reset.hidden = own;
    },
  };
}
