// Builds forms that send one request and show the server's refusal in place.

import { RequestError, request } from "../../transport/api.js";
import { absent, h, html, update } from "../../elements/dom.js";
import { remedyOf, sentence } from "../../elements/format.js";
import { passwordFault } from "./words.js";

/**
 * @import { Problem } from "#api"
 * @typedef {Record<string, string>} Values of the fields, by their names
 */

/** Show what the server refused. @param {Pick<Problem, "detail" | "remedy"> | null} problem */
export function refusal(problem) {
  if (!problem) return null;
  return html`<p class="note bad" role="alert">
    ${sentence(problem.detail)} <span class="remedy">${remedyOf(problem)}</span>
  </p>`;
}

let entries = 0;

/**
 * Build a field for a text.
 * @param {string} label
 * @param {{name: string, type?: "text" | "password", autocomplete?: string, most?: number}} options
 */
export function textField(label, { name, type = "text", autocomplete = "off", most }) {
  entries += 1;
  const id = `entry-${entries}`;
  return html`<div class="field">
    <label for=${id}>${label}</label>
    <input id=${id} name=${name} type=${type} required maxlength=${most ?? absent} autocomplete=${autocomplete} />
  </div>`;
}

/**
 * Build a form; it is emptied when the order was obeyed.
 * @param {{label: string, button: string, fields: unknown, send: (values: Values) => Promise<unknown>, fault?: (values: Values) => string}} options
 *   `send`: rejects with a RequestError where the server refuses; `fault`: why it is not sent, empty when it is
 */
export function orderForm({ label, button, fields, send, fault = () => "" }) {
  const status = h("div", {});
  const submit = h("button", { type: "submit", class: "plain primary", text: button });
  const order = async (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    const values = /** @type {Values} */ (Object.fromEntries(new FormData(form)));
    const detail = fault(values);
    update(status, refusal(detail === "" ? null : { detail }));
    if (detail !== "") return;
    submit.disabled = true;
    try {
      await send(values);
      form.reset();
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      update(status, refusal(error.document));
    } finally {
      submit.disabled = false;
    }
  };
  const form = h(
    "form",
    { class: "order-form", "aria-label": label, on: { submit: order } },
    html`<div class="fields">${fields}${submit}</div>`,
    status,
  );
  return form;
}

/** Build the two fields of a new password. */
export function newPasswordFields() {
  return [
    textField("New password, 10 characters or more", {
      name: "new_password",
      type: "password",
      autocomplete: "new-password",
    }),
    textField("The same once more", { name: "again", type: "password", autocomplete: "new-password" }),
  ];
}

/** @param {Values} values */
export function newPasswordFault({ new_password = "", again = "" }) {
  return passwordFault(new_password, again);
}

/** Build the form that changes the signed-in user's password. @param {() => void} changed */
export function passwordForm(changed) {
  return orderForm({
    label: "Change password",
    button: "Change password",
    fields: [
      textField("Present password", { name: "password", type: "password", autocomplete: "current-password" }),
      newPasswordFields(),
    ],
    fault: newPasswordFault,
    send: async ({ password, new_password }) => {
      await request("PUT", "/session/password", { body: { password, new_password } });
      changed();
    },
  });
}
