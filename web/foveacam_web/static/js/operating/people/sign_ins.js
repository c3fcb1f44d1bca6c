// The browsers that are signed in: everybody's for admins, else one's own; and one's own password.

import { h, html } from "../../elements/dom.js";
import { dayTime } from "../../elements/format.js";
import { badge, panel, textButton } from "../../elements/parts.js";
import { passwordForm } from "../session/form.js";
import { may } from "../session/words.js";
import { Listing } from "./listing.js";
import { ago, followedTable } from "./table.js";
import { browserWords } from "./words.js";

/**
 * @import { UserSessionDocument } from "#api"
 * @import { SessionReader } from "../session/reader.js"
 * @import { PeopleContext } from "./page.js"
 */

const COLUMNS = [
  { title: "Who", head: true },
  { title: "Browser" },
  { title: "Address" },
  { title: "Since" },
  { title: "Last seen" },
  { title: "", kind: /** @type {const} */ ("acts") },
];

/** @param {PeopleContext} context @returns {HTMLElement} */
export function openSignIns({ store, commands, session, follow }) {
  const { sign_in } = store.state;
  /** @type {Listing<UserSessionDocument>} */
  const listing = new Listing("/sessions", ({ sessions }) => sessions);
  const list = followedTable(listing, follow, {
    label: "Sign-ins",
    empty: "No browser is signed in by name.",
    columns: COLUMNS,
    key: ({ id }) => id,
    cells: (row) => cellsOf(row, listing, session),
  });
  const changed = () => commands.notify({ tone: "good", title: "Your password is changed", detail: "" });
  return h(
    "div",
    { class: "stack" },
    panel(may(sign_in, "administer") ? "Sign-ins" : "My sign-ins", list),
    sign_in?.kind === "user" && panel("My password", passwordForm(changed)),
  );
}

/** @param {UserSessionDocument} row @param {Listing<UserSessionDocument>} listing @param {SessionReader} session */
function cellsOf(
  { id, user, browser, address, created_utc, last_seen_utc, expires_utc, current, streams },
  listing,
  session,
) {
  const end = () => (current ? session.signOut() : listing.order(id, "DELETE", `/sessions/${encodeURIComponent(id)}`));
  return [
    html`<span class="name">${user}</span>`,
    [
      html`<span title=${browser}>${browserWords(browser)}</span>`,
      current && badge("good", "this browser"),
      !current && streams > 0 && badge("plain", "open now"),
    ],
    address,
    html`<time datetime=${created_utc} title="Until ${dayTime(expires_utc)}">${dayTime(created_utc)}</time>`,
    ago(last_seen_utc),
    html`<span class="row-acts">
      ${textButton("Sign out", () => end(), { name: `Sign out ${user} at ${address}, ${browserWords(browser)}` })}
    </span>`,
  ];
}
