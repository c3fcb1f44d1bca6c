// Builds the page of people and their rights: people, services, sign-ins and the log for admins, for others their
// own sign-ins, and the form of the first admin while there are no users.

import { peopleAddress } from "../../addresses.js";
import { absent, h, html, update } from "../../elements/dom.js";
import { pageHead } from "../../pages.js";
import { openFirst } from "./first.js";
import { openLog } from "./log.js";
import { openServices } from "./services.js";
import { openSignIns } from "./sign_ins.js";
import { openUsers } from "./users.js";
import { contentOf } from "./words.js";
import { waiting } from "../../elements/waiting.js";

/**
 * @import { Commands, ConsoleState, PeopleTab, Store } from "#console"
 * @import { SessionReader } from "../session/reader.js"
 * @typedef {{store: Store, commands: Commands, session: SessionReader}} PeopleTools
 * @typedef {PeopleTools & {signal: AbortSignal, follow: (list: {read: () => unknown}) => void}} PeopleContext
 *   `signal`: aborted when the part is left; `follow`: lets a list be read now and at each reconnection
 */

/** @type {readonly {tab: PeopleTab, title: string, open: (context: PeopleContext) => HTMLElement}[]} */
const TABS = Object.freeze([
  { tab: "people", title: "People", open: openUsers },
  { tab: "services", title: "Services", open: openServices },
  { tab: "sign_ins", title: "Sign-ins", open: openSignIns },
  { tab: "log", title: "Log", open: openLog },
]);

/** @param {HTMLElement} place @param {PeopleTools} tools */
export function mountPeoplePage(place, tools) {
  const body = h("div", { class: "people-body" });
  let leave = new AbortController();
  let shown = "";
  tools.store.on(["people", "sign_in"], (state) => {
    const now = JSON.stringify([state.people, { ...state.sign_in, expires_utc: null }]);
    if (now === shown) return; // what is typed stays while the server is read again
    shown = now;
    leave.abort();
    leave = new AbortController();
    update(place, [pageHead("people-title", "People and rights"), tabsOf(state), body]);
    body.replaceChildren(...(state.people ? [opened(state, tools, leave.signal)] : []));
  });
}

/** @param {ConsoleState} state */
function tabsOf({ people, sign_in }) {
  if (!sign_in || contentOf(sign_in) !== "all") return null;
  return html`<nav class="wizard-tabs" aria-label="Parts of the page">
    ${TABS.map(
      ({ tab, title }) =>
        html`<a href=${peopleAddress(tab)} aria-current=${tab === people ? "page" : absent}>${title}</a>`,
    )}
  </nav>`;
}

/** @param {ConsoleState} state @param {PeopleTools} tools @param {AbortSignal} signal */
function opened({ people, sign_in }, tools, signal) {
  if (!sign_in) return h("div", {}, waiting("Loading the people"));
  const content = contentOf(sign_in);
  const follow = (/** @type {{read: () => unknown}} */ list) =>
    tools.store.on(["events_link"], () => void list.read(), signal);
  const context = { ...tools, signal, follow };
  if (content === "first") return openFirst(context);
  const open = content === "own" ? openSignIns : TABS.find(({ tab }) => tab === people)?.open;
  return (open ?? openUsers)(context);
}
