// Asks the operator to confirm that a positioner without reference switches is at its zero.

import { h } from "../../elements/dom.js";
import { keptButton } from "../../elements/parts.js";

/**
 * @typedef {{awaits_zero: boolean, connected: boolean}} Positioner
 * @param {string} name
 * @param {() => void} confirm
 */
export function zeroOf(name, confirm) {
  const button = keptButton("It stands at its zero", confirm, {
    name: `The ${name} stands at its zero`,
    title: "It has no reference switches: confirm this once it stands at its zero",
  });
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
