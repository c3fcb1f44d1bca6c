// The people of the server: adds them, changes their roles, and makes the links by which they choose a password.

import { request } from "../../transport/api.js";
import { choose } from "../../elements/ask.js";
import { h, html, update } from "../../elements/dom.js";
import { dayTime } from "../../elements/format.js";
import { badge, choiceField, panel, textButton, toolButton } from "../../elements/parts.js";
import { orderForm, textField } from "../session/form.js";
import { ROLES } from "../session/words.js";
import { Listing } from "./listing.js";
import { secretBox } from "./secret.js";
import { ago, followedTable } from "./table.js";
import { ROLE_CHOICES, nameFault, removalWords, stateWords, tokenWords, tokensOf, userName } from "./words.js";
import { ROOT } from "../../root.js";

/**
 * @import { InvitationDocument, ServiceTokenList, UserCreated, UserDocument } from "#api"
 * @import { PeopleContext } from "./page.js"
 * @typedef {{name: string, invitation: InvitationDocument}} Link
 */

/** @type {[string, string][]} */
const WAYS = [
  ["link", "a link, to choose a password"],
  ["password", "a password from me"],
];
const COLUMNS = [
  { title: "Name", head: true },
  { title: "Role" },
  { title: "State" },
  { title: "Last seen" },
  { title: "", kind: /** @type {const} */ ("acts") },
];

/** @param {PeopleContext} context @returns {HTMLElement} */
export function openUsers({ store, follow }) {
  const link = h("div", {});
  /** @type {Listing<UserDocument>} */
  const listing = new Listing("/users", ({ users }) => users);
  const showLink = (/** @type {Link | null} */ made) => update(link, made && linkBox(made, () => showLink(null)));
  const own = store.state.sign_in?.name ?? null;
  const orders = new UserOrders(listing, showLink, own);
  const list = followedTable(listing, follow, {
    label: "People",
    empty: "No user has been added yet.",
    columns: COLUMNS,
    key: ({ name }) => name,
    cells: (user) => cellsOf(user, own, orders),
  });
  return h("div", { class: "stack" }, panel("Add a user", addForm(listing, showLink), link), panel("People", list));
}

/** @param {Listing<UserDocument>} listing @param {(link: Link | null) => void} showLink */
function addForm(listing, showLink) {
  const password = h("div", { class: "fields" });
  const role = choiceField("Role", ROLE_CHOICES);
  const by = choiceField("Gets in by", WAYS, (way) => update(password, way === "password" && passwordField()));
  const form = orderForm({
    label: "Add a user",
    button: "Add",
    fields: [textField("Name, in lower case", { name: "name", most: 64 }), role.element, by.element, password],
    fault: ({ name = "" }) => nameFault(name),
    send: async ({ name = "", password: typed }) => {
      const body = { name: userName(name), role: role.value(), ...(typed ? { password: typed } : {}) };
      const { user, invitation } = /** @type {UserCreated} */ (await request("POST", "/users", { body }));
      showLink(invitation && { name: user.name, invitation });
      update(password, null);
      void listing.read();
    },
  });
  const roles = Object.values(ROLES).map(({ name, does }) => html`<li><b>${name}</b> ${does}.</li>`);
  return [form, html`<ul class="roles note">${roles}</ul>`];
}

function passwordField() {
  return textField("Password, 10 characters or more", {
    name: "password",
    type: "password",
    autocomplete: "new-password",
  });
}

/** @param {Link} link @param {() => void} done */
function linkBox({ name, invitation }, done) {
  return secretBox({
    title: `Link for ${name}`,
    text: new URL(ROOT + invitation.path, location.origin).href,
    note: `Send it to ${name}, who chooses a password there. It works once, until ${dayTime(invitation.expires_utc)}, and is shown only now.`,
    done,
  });
}

/** @param {UserDocument} user @param {string | null} own @param {UserOrders} orders */
function cellsOf(user, own, orders) {
  const { name, role, state, last_seen_utc } = user;
  const { text, tone, title } = stateWords(user);
  const disabled = state === "disabled";
  return [
    [html`<span class="name">${name}</span>`, name === own && badge("plain", "you")],
    html`<select aria-label="Role of ${name}" @change=${(/** @type {{currentTarget: HTMLSelectElement}} */ { currentTarget }) => void orders.setRole(user, currentTarget)}>
      ${ROLE_CHOICES.map(([value, words]) => html`<option value=${value} .selected=${value === role}>${words}</option>`)}
    </select>`,
    badge(tone, text, title),
    ago(last_seen_utc),
    html`<span class="row-acts">
      ${textButton("New link", () => orders.invite(name), {
        name: `New link for ${name}`,
        title: "Also for a forgotten password",
        disabled,
      })}
      ${textButton(disabled ? "Enable" : "Disable", () => orders.setDisabled(name, !disabled), {
        name: `${disabled ? "Enable" : "Disable"} ${name}`,
      })}
      ${toolButton(`Remove ${name}`, "trash", () => orders.remove(name), { title: "Remove" })}
    </span>`,
  ];
}

/** The orders about people. */
class UserOrders {
  #listing;
  #showLink;
  #own;

  /** @param {Listing<UserDocument>} listing @param {(link: Link | null) => void} showLink @param {string | null} own */
  constructor(listing, showLink, own) {
    this.#listing = listing;
    this.#showLink = showLink;
    this.#own = own;
  }

  /** @param {UserDocument} user @param {HTMLSelectElement} select */
  async setRole({ name, role }, select) {
    if (!(await this.#listing.order(name, "PATCH", pathOf(name), { role: select.value }))) select.value = role;
  }

  /** @param {string} name @param {boolean} disabled */
  async setDisabled(name, disabled) {
    const programs = disabled ? await this.#programsOf(name) : [];
    if (programs.length > 0) {
      const way = await choose({
        title: `Disable ${name}?`,
        text: `${name} is signed out everywhere. As long as ${name} is disabled, programs on ${name}’s authority are refused:`,
        list: programs,
        ways: [["yes", "Disable"]],
      });
      if (way === null) return;
    }
    await this.#listing.order(name, "PATCH", pathOf(name), { disabled });
  }

  /** @param {string} name */
  async invite(name) {
    const answer = await this.#listing.order(name, "POST", `${pathOf(name)}/invitation`);
    if (answer) this.#showLink({ name, invitation: /** @type {InvitationDocument} */ (answer) });
  }

  /** @param {string} name */
  async remove(name) {
    const programs = await this.#programsOf(name);
    /** @type {["keep" | "revoke", string][]} */
    const ways = [["revoke", programs.length > 0 ? "Remove and revoke" : "Remove"]];
    if (programs.length > 0 && name !== this.#own) ways.unshift(["keep", "Remove, keep tokens"]);
    const text = removalWords(name, programs.length);
    const way = await choose({ title: `Remove ${name}?`, text, list: programs, ways });
    if (way !== null)
      await this.#listing.order(name, "DELETE", `${pathOf(name)}${way === "keep" ? "?tokens=keep" : ""}`);
  }

  /** Return a line for each program (service token) that a user owns. @param {string} name */
  async #programsOf(name) {
    const { tokens } = /** @type {ServiceTokenList} */ (await request("GET", "/service_tokens"));
    return tokensOf(tokens, name).map(tokenWords);
  }
}

/** @param {string} name */
function pathOf(name) {
  return `/users/${encodeURIComponent(name)}`;
}
