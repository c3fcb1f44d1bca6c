// Lists the targets: shows, edits and removes each by keyboard, as the drawing does by pointer.

import { fill, h, html } from "../../elements/dom.js";
import { HUES } from "./drawing.js";
import { keptButton, textButton, toolButton } from "../../elements/parts.js";

/**
 * @import { MapPoint } from "#page"
 * @typedef {{move: (index: number, place: MapPoint) => void, remove: (index: number) => void, add: () => void, reset: () => void}} Orders
 */

/** @param {Orders} orders */
export function makeTargets(orders) {
  const list = h("ol", { class: "plan-targets" });
  const reset = keptButton("The map’s own", () => orders.reset(), { picture: "again" });
  const empty = h("p", { class: "empty", text: "No target yet: click on the plan, or add one." });
  /** @type {{inputs: HTMLInputElement[]}[]} */
  let rows = [];
  const element = h(
    "div",
    { class: "stack" },
    empty,
    list,
    html`<p class="actions">
      ${textButton("Add a target", () => orders.add(), { picture: "plus" })}
      ${reset}
    </p>`,
  );
  const rebuild = (/** @type {number} */ length) => {
    rows = Array.from({ length }, (_, index) => row(index));
    fill(
      list,
      ...rows.map(
        ({ inputs }, index) =>
          html`<li class="hue-${index % HUES}">
          <span class="mark" aria-hidden="true">${String(index)}</span>
          ${inputs.map((input, axis) => html`<label><span>${axis === 0 ? "x" : "y"}</span>${input}</label>`)}
          <span class="unit">m</span>
          ${toolButton(`Remove target ${index}`, "trash", () => orders.remove(index))}
        </li>`,
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
