// Builds the gallery: datasets, recordings and stills in tabs. tabs.js says how a tab is added.

import { addressOf } from "../calibration/route.js";
import { fill, focusOn, h, need } from "../dom.js";
import { icon } from "../icons.js";
import { GALLERY_ADDRESS, galleryAddress } from "./route.js";
import { TABS } from "./tabs.js";

/**
 * @import { GalleryPlace } from "#page"
 * @typedef {{
 *   store: import("../store.js").Store, commands: import("../commands.js").Commands, reader: import("./reader.js").GalleryReader
 * }} GalleryTools
 */

/**
 * @param {HTMLElement} place
 * @param {GalleryTools} tools
 */
export function mountGallery(place, tools) {
  const links = TABS.map(({ name, title }) => ({
    name,
    link: h("a", { href: galleryAddress(name), id: `to-${name}`, text: title }),
  }));
  const body = h("div", { class: "gallery-body", tabindex: "-1" });
  fill(
    place,
    head(),
    h(
      "nav",
      { class: "wizard-tabs", "aria-label": "Parts of the gallery" },
      links.map(({ link }) => link),
    ),
    body,
  );
  let leave = new AbortController();
  tools.store.on(["gallery"], ({ gallery }) => {
    leave.abort();
    leave = new AbortController();
    fill(body, gallery && opened(gallery, tools, leave.signal));
    for (const { name, link } of links) {
      if (name === gallery?.tab) link.setAttribute("aria-current", "page");
      else link.removeAttribute("aria-current");
    }
    turnPage(place, gallery !== null, body);
  });
}

/**
 * @param {GalleryPlace} at
 * @param {GalleryTools} tools
 * @param {AbortSignal} signal
 */
function opened(at, tools, signal) {
  const tab = TABS.find(({ name }) => name === at.tab);
  if (!tab)
    return h(
      "p",
      { class: "empty" },
      "There is no such page. ",
      h("a", { href: GALLERY_ADDRESS, text: "To the datasets" }),
      ".",
    );
  return tab.open(at, { ...tools, signal, follow: (reader) => tools.reader.follow(reader, signal) });
}

function head() {
  return h(
    "div",
    { class: "wizard-head" },
    h("h2", { id: "gallery-title", tabindex: "-1", text: "Gallery" }),
    h(
      "a",
      { class: "plain back", href: addressOf(null), "aria-label": "Back to the console" },
      icon("back"),
      h("span", { text: "Console" }),
    ),
  );
}

/**
 * Show or hide the gallery, and move the focus to what is then visible.
 * @param {HTMLElement} place
 * @param {boolean} open
 * @param {HTMLElement} body
 */
function turnPage(place, open, body) {
  if (open) window.scrollTo(0, 0);
  if (open === !place.hidden) {
    if (open && document.activeElement === document.body) focusOn(body);
    return;
  }
  place.hidden = !open;
  const other = document.querySelector(".wizard:not([hidden])") !== null; // another page is open already
  need("console").hidden = open || other;
  if (open || !other) focusOn(need(open ? "gallery-title" : "console"));
}
