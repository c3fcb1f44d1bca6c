// Asks the operator to confirm that a positioner without reference switches is at its zero.

import { h } from "../../elements/dom.js";

/**
 * @typedef {{awaits_zero: boolean, connected: boolean}} Positioner
 * @param {string} name
 * @param {() => void} confirm
 */
export function zeroOf(name, confirm) {
  const button = h(
    "button",
    {
      type: "button",
      class: "plain",
      "aria-label": `The ${name} stands at its zero`,
      on: { click: confirm },
      title: "It has no reference switches: confirm this once it stands at its zero",
    },
    "It stands at its zero",
  );
  const element = h("div", { class: "actions" }, button);
  element.hidden = true;
  return {
    element,
    update: (/** @type {Positioner | null} */ now, /** @type {boolean} */ busy) => {
      element.hidden = !now?.awaits_zero;
      button.disabled = busy || !now?.connected;
    },
  };
}
