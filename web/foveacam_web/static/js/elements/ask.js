// Asks the operator before something that cannot simply be taken back.

import { fill, h, html } from "./dom.js";

/**
 * Show a question and resolve with the answer; Escape, and a click beside it, mean no.
 * @param {{title: string, text: string, yes: string}} question `yes`: text of the button that goes on
 * @returns {Promise<boolean>}
 */
export async function ask({ title, text, yes }) {
  return (await choose({ title, text, ways: [["yes", yes]] })) !== null;
}

/**
 * Show the ways to go on and resolve with the chosen one, null for none; Escape, and a click beside it, mean none.
 * @template {string} W
 * @param {{title: string, text: string, list?: string[], ways: [W, string][]}} question `list`: what it is about, a
 *   line each; `ways`: the value and the button's text of each, the usual one last
 * @returns {Promise<W | null>}
 */
export function choose({ title, text, list = [], ways }) {
  const dialog = h("dialog", { class: "sheet", role: "alertdialog", "aria-label": title });
  const button = (/** @type {string} */ label, /** @type {string} */ value, kind = "plain") =>
    html`<button type="button" class=${kind} @click=${() => dialog.close(value)}>${label}</button>`;
  const [usual, ...others] = ways.toReversed();
  fill(
    dialog,
    html`<header><h2>${title}</h2></header>`,
    html`<p>${text}</p>`,
    list.length > 0 &&
      html`<ul>
        ${list.map((line) => html`<li>${line}</li>`)}
      </ul>`,
    html`<div class="actions">
      ${button("Cancel", "")}${others.map(([value, label]) => button(label, value))}${
        usual && button(usual[1], usual[0], "plain primary")
      }
    </div>`,
  );
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close(""));
  document.body.append(dialog);
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(ways.find(([value]) => value === dialog.returnValue)?.[0] ?? null);
    });
  });
}
