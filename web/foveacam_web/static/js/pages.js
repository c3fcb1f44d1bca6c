// The pages over the console: shows the one that the address names, with its head, and lends it the live panes.

import { CONSOLE_ADDRESS, pagesAt } from "./addresses.js";
import { focusOn, html, need } from "./dom.js";
import { icon } from "./icons.js";

/**
 * @import { ConsoleState, Role } from "#page"
 * @import { Store } from "./store.js"
 * @import { Views } from "./video/views.js"
 * @typedef {ReadonlyMap<Role, HTMLElement>} Slots where a page shows the live pane of each camera
 */

/** `clicked`: whether clicks on the panes that it borrows mean something. */
const PAGES = /** @type {const} */ ([
  { key: "wizard", id: "calibration", title: "wizard-title", clicked: false },
  { key: "rig_page", id: "rig-page", title: "rig-page-title", clicked: false },
  { key: "setup_page", id: "setup-page", title: "setup-title", clicked: false },
  { key: "settings_page", id: "settings-page", title: "settings-title", clicked: false },
  { key: "capture_page", id: "capture-page", title: "capture-title", clicked: false },
  { key: "follow_page", id: "follow-page", title: "follow-title", clicked: true },
  { key: "loop_page", id: "loop-page", title: "loop-title", clicked: true },
  { key: "gallery", id: "gallery", title: "gallery-title", clicked: false },
  { key: "planner_page", id: "planner", title: "planner-title", clicked: false },
  { key: "compare_page", id: "compare-page", title: "compare-title", clicked: false },
]);

/** Return the page that covers the console, if any. @param {ConsoleState} state */
export function openPage(state) {
  return PAGES.find(({ key }) => state[key]);
}

/** Keep the state equal to the address's fragment. @param {Store} store */
export function followAddress(store) {
  const read = () => {
    const news = Object.entries(pagesAt(location.hash)).filter(
      ([key, value]) => JSON.stringify(value) !== JSON.stringify(store.state[/** @type {keyof ConsoleState} */ (key)]),
    );
    if (news.length > 0) store.set(Object.fromEntries(news));
  };
  window.addEventListener("hashchange", read);
  read();
}

/**
 * Show the open page or the console, and move panes and focus there.
 * @param {{store: Store, views: Views, slots: Partial<Record<keyof ConsoleState, Slots>>}} context
 */
export function turnPages({ store, views, slots }) {
  store.on(
    PAGES.map(({ key }) => key),
    (state) => {
      const open = openPage(state);
      lendPanes(views, open && slots[open.key], open?.clicked ?? false);
      if (open === PAGES.find(({ id }) => !need(id).hidden)) return;
      for (const page of PAGES) need(page.id).hidden = page !== open;
      need("console").hidden = open !== undefined;
      window.scrollTo(0, 0);
      focusOn(need(open?.title ?? "console"));
    },
  );
}

/**
 * Move the live panes into these slots, or back into the console.
 * @param {Views} views
 * @param {Slots | undefined} slots
 * @param {boolean} clicked whether clicks mean something in these slots
 */
function lendPanes(views, slots, clicked) {
  // left comes before right in the console, so it is put in front last
  for (const role of /** @type {const} */ (["wide", "right", "left"])) {
    const { element, surface } = views.pane(role);
    const place = slots?.get(role) ?? need(role === "wide" ? "wide" : "eyes");
    if (element.parentElement !== place) place.prepend(element);
    surface.inert = slots !== undefined && !clicked;
  }
}

/**
 * Build the head of a page, with the link back to the console.
 * @param {string} id of its title
 * @param {string} title
 * @param {...unknown} beside
 */
export function pageHead(id, title, ...beside) {
  return html`<div class="wizard-head">
    <h2 id=${id} tabindex="-1">${title}</h2>
    ${beside}
    <a class="plain back" href=${CONSOLE_ADDRESS} aria-label="Back to the console">${icon("back")}<span>Console</span></a>
  </div>`;
}
