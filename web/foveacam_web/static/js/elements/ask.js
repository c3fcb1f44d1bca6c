// Asks the operator before something that cannot simply be taken back.

import { fill, h, html } from "./dom.js";

/**
 * Show a question and resolve with the answer; Escape, and a click beside it, mean no.
 * @param {{title: string, text: string, yes: string}} question `yes`: text of the button that goes on
 * @returns {Promise<boolean>}
 */
export function ask({ title, text, yes }) {
  const dialog = h("dialog", { class: "sheet", role: "alertdialog", "aria-label": title });
  const button = (/** @type {string} */ label, /** @type {string} */ value, kind = "plain") =>
    html`<button type="button" class=${kind} @click=${() => dialog.close(value)}>${label}</button>`;
  fill(
    dialog,
    html`<header><h2>${title}</h2></header>`,
    html`<p>${text}</p>`,
    html`<div class="actions">${button("Cancel", "no")}${button(yes, "yes", "plain primary")}</div>`,
  );
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close("no"));
  document.body.append(dialog);
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(dialog.returnValue === "yes");
    });
  });
}
