// How the mirrors come to rest: the time to one pixel and to one percent, the resonance, how long it rings.

import { changing, h } from "../dom.js";
import { MISSING, number } from "../format.js";
import { nothing, panel, starter } from "./parts.js";
import { figure, picturesOf } from "./pictures.js";

/**
 * @typedef {import("../types.js").ConsoleState} ConsoleState
 * @typedef {import("./documents.js").Picture} Picture
 * @typedef {import("./documents.js").SettleAxis} SettleAxis
 * @typedef {import("./page.js").WizardContext} WizardContext
 */

/** @param {WizardContext} context */
export function makeSettleStep({ store, orders }) {
  const live = h("div", { class: "live-slot" });
  const table = h("div", { class: "scroll-x" });
  const diagrams = h("div", { class: "diagrams" });
  const showTable = changing(table, tableOf);
  const showDiagrams = changing(diagrams, (/** @type {Picture[]} */ pictures) => pictures.length ? pictures.map(figure) : [nothing("How each axis came to rest is drawn here once it was measured.")]);
  store.on(["session"], ({ session }) => {
    showTable(session?.settle?.axes ?? []);
    showDiagrams(picturesOf(session, ["settle"]));
  });
  const start = starter({ label: "Characterise", store, act: () => orders.run("settle"), primary: true, keys: ["session"], named: ({ session }) => (session?.settle ? "Characterise again" : "Characterise") });
  const element = h("div", { class: "step step-settle" },
    h("div", { class: "seeing" },
      panel("Settle times", h("p", { class: "lead", text: "Each axis makes a step, and the fovea takes pictures later and later after it; how far they lie from the last one is how the mirror came to rest. The trigger’s timing and the raster follow from it." }),
        h("p", { class: "remedy", text: "Let both eyes look at something with texture that stands still. The pictures are dark meanwhile: short exposures freeze the motion." }), h("p", { class: "actions" }, start), table), live),
    panel("Diagram", diagrams));
  return { element, live };
}

/** @param {SettleAxis[]} axes */
function tableOf(axes) {
  if (axes.length === 0) return [nothing("Not measured yet.")];
  const value = (/** @type {number | null} */ number_, /** @type {number} */ decimals, /** @type {string} */ unit) => (number_ === null ? MISSING : `${number(number_, decimals)}${unit}`);
  return [h("table", { class: "compare" },
    h("thead", {}, h("tr", {}, ["Axis", "to 1 px", "to 1 %", "Resonance", "Q"].map((text) => h("th", { scope: "col", text })))),
    h("tbody", {}, axes.map((axis) => h("tr", {}, h("th", { scope: "row", class: `eye-${axis.eye}`, text: `${axis.eye} ${axis.axis}` }),
      h("td", { text: value(axis.settle_ms, 2, " ms") }), h("td", { text: value(axis.settle_1pct_ms, 2, " ms") }),
      h("td", { text: value(axis.resonance_hz, 0, " Hz") }), h("td", { text: value(axis.quality, 1, "") })))))];
}

/** @param {ConsoleState} state */
export function settleProgress({ session }) {
  const slowest_ms = Math.max(...(session?.settle?.axes ?? []).map(({ settle_ms }) => settle_ms ?? 0));
  return Number.isFinite(slowest_ms) ? { tone: "good", text: `${number(slowest_ms, 1)} ms` } : null;
}
