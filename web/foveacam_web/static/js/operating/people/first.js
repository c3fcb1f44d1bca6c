// Form of the first admin, on a server without sign-in by name.

import { request } from "../../transport/api.js";
import { h, html } from "../../elements/dom.js";
import { panel } from "../../elements/parts.js";
import { newPasswordFault, newPasswordFields, orderForm, textField } from "../session/form.js";
import { MODES, nameFault, userName } from "./words.js";

/** @import { PeopleContext } from "./page.js" */

/** @param {PeopleContext} context @returns {HTMLElement} */
export function openFirst({ store, commands, session }) {
  const mode = store.state.sign_in?.mode === "token" ? "token" : "open";
  const form = orderForm({
    label: "The first admin",
    button: "Add, and ask for names from now on",
    fields: [
      textField("Name, in lower case", { name: "name", autocomplete: "username", most: 64 }),
      newPasswordFields(),
    ],
    fault: ({ name = "", ...passwords }) => nameFault(name) || newPasswordFault(passwords),
    send: async ({ name = "", new_password }) => {
      await request("POST", "/users", { body: { name: userName(name), role: "admin", password: new_password } });
      await session.readAll();
      commands.notify({
        tone: "good",
        title: "From now on this server asks for a name and a password",
        detail: "This browser is signed in.",
      });
    },
  });
  return h(
    "div",
    { class: "stack" },
    panel(
      "Who may do what",
      html`<p class="lead">${MODES[mode]}</p>`,
      html`<p class="lead">
        Add yourself as the first admin, and everybody signs in by name: others as viewers, operators or
        admins, programs by tokens of their own.
      </p>`,
      form,
    ),
  );
}
