// The tokens of programs that use the server by themselves.

import { request } from "../../transport/api.js";
import { ask } from "../../elements/ask.js";
import { h, html, update } from "../../elements/dom.js";
import { dayTime } from "../../elements/format.js";
import { badge, numberField, panel, textButton, tickField } from "../../elements/parts.js";
import { orderForm, textField } from "../session/form.js";
import { Listing } from "./listing.js";
import { secretBox } from "./secret.js";
import { ago, followedTable } from "./table.js";
import { SCOPES, isExpired, scopeWords } from "./words.js";

/**
 * @import { ServiceTokenCreated, ServiceTokenDocument } from "#api"
 * @import { PeopleContext } from "./page.js"
 */

const USUAL_DAYS = 90;
const MOST_DAYS = 3650;
const COLUMNS = [
  { title: "Name", head: true },
  { title: "Begins with" },
  { title: "May" },
  { title: "Made" },
  { title: "Ends" },
  { title: "Last used" },
  { title: "", kind: /** @type {const} */ ("acts") },
];

/** @param {PeopleContext} context @returns {HTMLElement} */
export function openServices({ follow }) {
  const secret = h("div", {});
  /** @type {Listing<ServiceTokenDocument>} */
  const listing = new Listing("/service_tokens", ({ tokens }) => tokens);
  const show = (/** @type {ServiceTokenCreated | null} */ made) =>
    update(secret, made && tokenBox(made, () => show(null)));
  const list = followedTable(listing, follow, {
    label: "Tokens",
    empty: "No program has a token yet.",
    columns: COLUMNS,
    key: ({ id }) => id,
    cells: (token) => cellsOf(token, listing),
  });
  return h("div", { class: "stack" }, panel("Add a service", addForm(listing, show), secret), panel("Tokens", list));
}

/** @param {Listing<ServiceTokenDocument>} listing @param {(made: ServiceTokenCreated | null) => void} show */
function addForm(listing, show) {
  const scopes = SCOPES.map(({ right, name, does }) => ({ right, ...tickField(`${name}: ${does}`, right === "view") }));
  const days = numberField("Works for, days", { value: USUAL_DAYS, min: 1, max: MOST_DAYS });
  const forEver = tickField("For ever", false);
  forEver.input.addEventListener("change", () => (days.input.disabled = forEver.value()));
  const chosen = () => scopes.filter(({ value }) => value()).map(({ right }) => right);
  const form = orderForm({
    label: "Add a service",
    button: "Make a token",
    fields: [
      textField("Name of the program", { name: "name", most: 60 }),
      h(
        "div",
        { class: "field" },
        html`<span>It may</span>`,
        h("div", { class: "ticks" }, ...scopes.map(({ element }) => element)),
      ),
      h("div", { class: "life" }, days.element, forEver.element),
    ],
    fault: () => (chosen().length > 0 ? "" : "The token may do nothing yet; tick what the program may do."),
    send: async ({ name = "" }) => {
      const body = { name: name.trim(), scopes: chosen(), days: forEver.value() ? null : days.value() };
      show(/** @type {ServiceTokenCreated} */ (await request("POST", "/service_tokens", { body })));
      days.input.disabled = false;
      void listing.read();
    },
  });
  days.input.required = true;
  return form;
}

/** @param {ServiceTokenCreated} made @param {() => void} done */
function tokenBox({ token, document: { name } }, done) {
  return secretBox({
    title: `Token of ${name}`,
    text: token,
    note: "The program sends it with each request, as “Authorization: Bearer …”. It is shown only now: the server keeps no copy that could be read.",
    done,
  });
}

/** @param {ServiceTokenDocument} token @param {Listing<ServiceTokenDocument>} listing */
function cellsOf(token, listing) {
  const { id, name, prefix, scopes, created_by, owner, created_utc, expires_utc, last_used_utc } = token;
  const revoke = async () => {
    const sure = await ask({
      title: `Revoke the token of ${name}?`,
      text: `From now on whatever sends it is refused. This cannot be taken back; ${name} needs a new token.`,
      yes: "Revoke",
    });
    if (sure) await listing.order(id, "DELETE", `/service_tokens/${encodeURIComponent(id)}`);
  };
  return [
    html`<span class="name">${name}</span>`,
    html`<code>${prefix}…</code>`,
    scopeWords(scopes),
    html`${ago(created_utc)} by <span class="name">${created_by}</span>${
      owner !== null && owner !== created_by && html`, now of <span class="name">${owner}</span>`
    }`,
    isExpired(token, Date.now())
      ? badge("warn", "Expired", dayTime(expires_utc))
      : expires_utc === null
        ? "never"
        : dayTime(expires_utc),
    ago(last_used_utc),
    html`<span class="row-acts">
      ${textButton("Revoke", () => revoke(), { name: `Revoke the token of ${name}` })}
    </span>`,
  ];
}
