// The dialog of the control lease: take it, ask for it, hand it over, take it over with a reason.

import { h, html, setText } from "../../elements/dom.js";
import { sheet } from "../../panels/dialogs.js";
import { NAMELESS, holderName, isPerson, leaseWays, leaseWords } from "./words.js";
import { keptButton } from "../../elements/parts.js";

/**
 * @import { Commands, Store } from "#console"
 */

/** @param {{store: Store, commands: Commands}} context */
export function makeLease({ store, commands }) {
  const state = h("p", { class: "lead" });
  const name = h("input", { type: "text", id: "holder", maxlength: "60", value: NAMELESS, autocomplete: "name" });
  const reason = h("input", { type: "text", id: "lease-reason", maxlength: "80", required: true });
  const named = h("div", { class: "setting" }, html`<label for="holder">Your name</label>`, name);
  const reasoned = h(
    "div",
    { class: "setting" },
    html`<label for="lease-reason">Reason, which is logged</label>`,
    reason,
  );
  const asking = h("p", { class: "lead" });
  const holder = () =>
    isPerson(store.state.sign_in) ? holderName(store.state.sign_in) : name.value.trim() || NAMELESS;
  const takeOver = () => {
    if (!reasoned.hidden && !reason.reportValidity()) return;
    void commands.takeLease(holder(), true, reasoned.hidden ? null : reason.value.trim());
  };
  const buttons = {
    take: button("Take control", () => commands.takeLease(holder(), false)),
    ask: button("Ask for it", () => commands.askLease(holder())),
    over: button("Take over", takeOver),
    give: button("Give it back", () => commands.giveLease()),
    hand: button("Hand over", () => commands.answerLease(true)),
    keep: button("Keep it", () => commands.answerLease(false)),
  };
  const dialog = sheet("Control", state, asking, named, reasoned, h("p", { class: "buttons" }, Object.values(buttons)));
  store.on(["lease", "lease_token", "sign_in", "lease_asked"], ({ lease, lease_token, sign_in, lease_asked }) => {
    const now = { lease, mine: Boolean(lease_token), sign_in, asked: lease_asked };
    const ways = leaseWays(now);
    setText(state, leaseWords(now));
    setText(asking, lease?.asked_by ? `${lease.asked_by} asks for control.` : "");
    asking.hidden = !ways.answer;
    named.hidden = isPerson(sign_in) || now.mine;
    reasoned.hidden = !(ways.over && ways.reason);
    for (const [way, one] of Object.entries(buttons))
      one.hidden = !(way === "hand" || way === "keep" ? ways.answer : ways[/** @type {keyof typeof ways} */ (way)]);
  });
  return dialog;
}

/** @param {string} text @param {() => unknown} act */
function button(text, act) {
  return keptButton(text, () => act());
}
