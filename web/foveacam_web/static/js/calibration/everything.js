// The sheet that starts the whole calibration: what will happen, what it is called, and whether it goes into use.

import { h, say } from "../dom.js";
import { sheet } from "../panels/dialogs.js";
import { starter, tickField } from "./parts.js";

/** @typedef {import("./page.js").WizardContext} WizardContext */

/** @param {WizardContext} context */
export function makeEverything({ store, orders }) {
  const label = h("input", { type: "text", id: "all-label", maxlength: 80, placeholder: "date and rig", autocomplete: "off" });
  const fresh = tickField("Measure everything anew, in a session of its own", true);
  const activate = tickField("Take the result into use", true);
  const turn = h("p", { class: "remedy" });
  const act = async () => {
    dialog.close();
    if (fresh.value() && !(await orders.newSession(label.value.trim()))) return;
    await orders.run("all", { activate: activate.value() });
  };
  const start = starter({
    label: "Start", store, act, primary: true, keys: ["pan_tilt"],
    why: ({ pan_tilt }) => (pan_tilt && !pan_tilt.present ? "This rig has no pan-tilt, and none by hand is set up." : null),
  });
  const dialog = sheet("Calibrate everything",
    h("ol", { class: "plan" },
      h("li", {}, h("b", { text: "Wide camera. " }), "Somebody shows the board at its station."),
      h("li", {}, h("b", { text: "Mirrors. " }), "The rig turns to each station with markers; both eyes centre theirs at every node."),
      h("li", {}, h("b", { text: "Rectify. " }), "The models are fitted and chosen by cross-validation."),
      h("li", {}, h("b", { text: "Check. " }), "The result is proved at places that were not measured.")),
    turn,
    h("div", { class: "setting" }, h("label", { for: "all-label", text: "Label" }), label), fresh.element, activate.element,
    h("p", { class: "actions" }, start));
  store.on(["pan_tilt"], ({ pan_tilt }) => say(turn, !pan_tilt?.present ? "" : pan_tilt.moves_itself
    ? "The rig and its mirrors will move: keep clear. STOP and Cancel work all the time, and what was measured is kept."
    : "You turn the rig by hand: the wizard says where to. Cancel works all the time, and what was measured is kept."));
  return dialog;
}
