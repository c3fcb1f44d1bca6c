// Builds the bar with the pages of the console, one for each activity, and the menu More with the other pages.

import {
  ACCEPTANCE_ADDRESS,
  CAPTURE_ADDRESS,
  COMPARE_ADDRESS,
  CONSOLE_ADDRESS,
  ENGINE_ADDRESS,
  FOLLOW_ADDRESS,
  GALLERY_ADDRESS,
  LOOP_ADDRESS,
  PEOPLE_ADDRESS,
  PLANNER_ADDRESS,
  RIG_ADDRESS,
  RIGS_ADDRESS,
  SETTINGS_ADDRESS,
  SETUP_ADDRESS,
  wizardAddress,
} from "../addresses.js";
import { fill, h, html } from "../elements/dom.js";
import { icon } from "../elements/icons.js";
import { PAGE_KEYS, openPage } from "../pages.js";
import { ROOT } from "../root.js";

/**
 * @import { Store } from "#console"
 * @import { IconName } from "../elements/icons.js"
 * @typedef {{label: string, hint: string, href: string}} Place a page; `hint`: what it is for
 * @typedef {{label: string, hint?: string, keys?: string, act: () => void}} Order
 */

/** The pages of the bar. @type {(Place & {picture: IconName, pages: string[]})[]} `pages`: keys of the pages below it */
export const ACTIVITIES = [
  {
    label: "Look",
    hint: "The live views: click, and both foveae look there",
    href: CONSOLE_ADDRESS,
    picture: "target",
    pages: ["follow_page", "loop_page", "compare_page"],
  },
  {
    label: "Capture",
    hint: "Raster datasets, and stills of the wide view",
    href: CAPTURE_ADDRESS,
    picture: "raster",
    pages: ["capture_page"],
  },
  {
    label: "Gallery",
    hint: "What was captured and recorded",
    href: GALLERY_ADDRESS,
    picture: "pictures",
    pages: ["gallery"],
  },
  {
    label: "Calibrate",
    hint: "Cameras, mirrors, and whether they still agree",
    href: wizardAddress("overview"),
    picture: "scope",
    pages: ["wizard", "acceptance_page"],
  },
  {
    label: "Rig",
    hint: "Cameras, trigger, mirrors, steering by hand",
    href: RIG_ADDRESS,
    picture: "sliders",
    pages: ["rig_page", "setup_page", "rigs_page", "engine_page"],
  },
];

/** The pages of the menu. @type {[string, Place[]][]} */
export const MORE = [
  [
    "Look",
    [
      { label: "Followed targets", hint: "Each with its trail", href: FOLLOW_ADDRESS },
      { label: "Vergence loop", hint: "Eyes that stay on a target by feedback", href: LOOP_ADDRESS },
      { label: "Compare depth", hint: "Two methods on the same look", href: COMPARE_ADDRESS },
      { label: "Windows of views", hint: "Live views in a window of their own", href: `${ROOT}/windows` },
    ],
  ],
  ["Calibrate", [{ label: "Acceptance", hint: "The rig measures itself and names faults", href: ACCEPTANCE_ADDRESS }]],
  ["Study", [{ label: "Planner", hint: "Where to stand, and how exact it gets there", href: PLANNER_ADDRESS }]],
  [
    "Rig",
    [
      { label: "Set-up", hint: "Which cameras and controller the rig has", href: SETUP_ADDRESS },
      { label: "Rigs", hint: "Several rigs on one page", href: RIGS_ADDRESS },
      { label: "Engine", hint: "What computes, and how long", href: ENGINE_ADDRESS },
    ],
  ],
  [
    "Server",
    [
      { label: "People", hint: "Who may use this server", href: PEOPLE_ADDRESS },
      { label: "All settings", hint: "Presets, storage, defaults of everybody", href: SETTINGS_ADDRESS },
    ],
  ],
];

/**
 * Fill the bar.
 * @param {HTMLElement} place
 * @param {{store: Store, orders: Order[]}} context `orders`: of the menu, after its pages
 */
export function mountNavigation(place, { store, orders }) {
  const menu = h("div", { id: "more-menu", class: "more-menu", popover: "auto", "aria-label": "More" });
  const more = html`<button type="button" class="activity more-button" popovertarget="more-menu" aria-haspopup="true">
    ${icon("rows")}<span>More</span>
  </button>`;
  menu.addEventListener("click", ({ target }) => {
    if (target instanceof Element && target.closest("a, button")) menu.hidePopover();
  });
  fill(
    menu,
    ...MORE.map(([title, places]) => menuGroup(title, places.map(menuLink))),
    menuGroup("This browser", orders.map(menuButton)),
  );
  const show = (/** @type {import("#console").ConsoleState} */ state) => {
    const open = openPage(state)?.key;
    const links = ACTIVITIES.map(
      ({ label, hint, href, picture, pages }) =>
        html`<a
          class="activity" href=${href} title=${hint} aria-current=${isHere(open, href, pages) ? "page" : "false"}
        >${icon(picture)}<span>${label}</span></a>`,
    );
    fill(place, ...links, more);
  };
  place.after(menu);
  store.on(PAGE_KEYS, show);
}

/** @param {string | undefined} open @param {string} href @param {string[]} pages */
function isHere(open, href, pages) {
  return open === undefined ? href === CONSOLE_ADDRESS : pages.includes(open);
}

/** @param {string} title @param {unknown[]} entries */
function menuGroup(title, entries) {
  return html`<section><h3>${title}</h3><ul>${entries.map((entry) => html`<li>${entry}</li>`)}</ul></section>`;
}

/** @param {Place} place */
const menuLink = ({ label, hint, href }) => html`<a href=${href}><b>${label}</b><span>${hint}</span></a>`;

/** @param {Order} order */
const menuButton = ({ label, hint, keys, act }) =>
  html`<button type="button" @click=${act}><b>${label}</b><span>${hint ?? ""}${keys && html` <kbd>${keys}</kbd>`}</span></button>`;
