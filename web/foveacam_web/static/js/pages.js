// The pages over the console: loads and shows the one that the address names, and lends it the live panes.

import { CONSOLE_ADDRESS, pagesAt } from "./addresses.js";
import { fill, focusOn, html, need } from "./elements/dom.js";
import { icon } from "./elements/icons.js";
import { textButton } from "./elements/parts.js";
import { waiting } from "./elements/waiting.js";

/**
 * @import { ConsoleState, Role, Store } from "#console"
 * @import { Views } from "./video/views.js"
 * @typedef {ReadonlyMap<Role, HTMLElement>} Slots where a page shows the live pane of each camera
 * @typedef {(typeof PAGES)[number]} Page
 * @typedef {Readonly<Record<Page["key"], () => Promise<(place: HTMLElement) => Slots | void>>>} Loaders each loads the modules
 *   of a page, and resolves with what builds it
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
  { key: "people", id: "people-page", title: "people-title", clicked: false },
  { key: "compare_page", id: "compare-page", title: "compare-title", clicked: false },
  { key: "engine_page", id: "engine-page", title: "engine-title", clicked: false },
  { key: "rigs_page", id: "rigs-page", title: "rigs-title", clicked: false },
  { key: "acceptance_page", id: "acceptance-page", title: "acceptance-title", clicked: false },
]);

/** The keys of the state that say which page is open. */
export const PAGE_KEYS = PAGES.map(({ key }) => key);

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
 * @param {{store: Store, views: Views, loaders: Loaders}} context
 */
export function turnPages({ store, views, loaders }) {
  const built = new BuiltPages(loaders);
  const open = async (/** @type {Page} */ page) => {
    await built.build(page);
    if (openPage(store.state) !== page) return;
    lendPanes(views, built.slots(page), page.clicked);
    focusOn(need(page.title));
  };
  store.on(PAGE_KEYS, (state) => {
    const page = openPage(state);
    lendPanes(views, page && built.slots(page), page?.clicked ?? false);
    if (page === PAGES.find(({ id }) => !need(id).hidden)) return;
    for (const other of PAGES) need(other.id).hidden = other !== page;
    need("console").hidden = page !== undefined;
    window.scrollTo(0, 0);
    if (page) void open(page);
    else focusOn(need("console"));
  });
}

/** The pages that were opened so far; each is loaded and built when it is opened first. */
class BuiltPages {
  #loaders;
  /** @type {Map<Page, Slots | undefined>} */
  #slots = new Map();
  /** @type {Map<Page, Promise<void>>} */
  #begun = new Map();

  /** @param {Loaders} loaders */
  constructor(loaders) {
    this.#loaders = loaders;
  }

  /** @param {Page} page */
  slots(page) {
    return this.#slots.get(page);
  }

  /** Load the modules of a page and build it, unless that was done. @param {Page} page */
  build(page) {
    const begun = this.#begun.get(page) ?? this.#load(page);
    this.#begun.set(page, begun);
    return begun;
  }

  /** @param {Page} page */
  async #load(page) {
    const place = need(page.id);
    fill(place, waiting("Loading the page"));
    const build = await this.#loaders[page.key]().catch((/** @type {unknown} */ error) => {
      fill(place, notLoaded());
      throw error;
    });
    fill(place);
    this.#slots.set(page, build(place) ?? undefined);
  }
}

/** Return the replacement of a page whose modules did not arrive; a browser does not ask twice for a module. */
function notLoaded() {
  return html`<div class="wizard-head"><a class="plain back" href=${CONSOLE_ADDRESS}>${icon("back")}Console</a></div>
    <p class="note bad" role="alert">
      This page was not loaded: the server did not answer, or it was updated. Load the console again.
      ${textButton("Load again", () => location.reload())}
    </p>`;
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
