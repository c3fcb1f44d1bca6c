// Builds the gallery: datasets, recordings and stills in tabs, one entry of TABS each: `name` is in the address, `title`
// on the tab, and `open` builds the page of an address each time it is visited; its `id` is null for the list.
// Everything that `open` starts must end with `context.signal`, which is aborted when the page is left:
// `store.on(keys, listener, signal)`, `addEventListener(…, { signal })`, and `context.follow(reader)`, which reads at
// once and after each reconnection, and receives the server's events.

import { GALLERY_ADDRESS, galleryAddress } from "../../addresses.js";
import { absent, focusOn, h, html, update } from "../../elements/dom.js";
import { pageHead } from "../../pages.js";
import { openDatasets } from "./datasets.js";
import { openRecordings } from "./recordings.js";
import { openStills } from "./stills.js";

/**
 * @import { Commands, GalleryPlace, Store } from "#console"
 * @import { Reader } from "../../transport/sync.js"
 * @import { GalleryReader } from "./reader.js"
 * @typedef {{store: Store, commands: Commands, signal: AbortSignal, follow: (reader: Reader) => void}} GalleryContext
 *   what the gallery gives to a page that it opens; `signal`: aborted when the operator leaves the page
 * @typedef {{name: string, title: string, open: (at: GalleryPlace, context: GalleryContext) => HTMLElement}} GalleryTab
 * @typedef {{store: Store, commands: Commands, reader: GalleryReader}} GalleryTools
 */

/** @type {readonly GalleryTab[]} */
const TABS = Object.freeze([
  { name: "datasets", title: "Datasets", open: openDatasets },
  { name: "recordings", title: "Recordings", open: openRecordings },
  { name: "stills", title: "Stills", open: openStills },
]);

/** @param {HTMLElement} place @param {GalleryTools} tools */
export function mountGallery(place, tools) {
  const body = h("div", { class: "gallery-body", tabindex: "-1" });
  let leave = new AbortController();
  tools.store.on(["gallery"], ({ gallery }) => {
    leave.abort();
    leave = new AbortController();
    update(place, [pageHead("gallery-title", "Gallery"), tabsOf(gallery), body]);
    body.replaceChildren(...(gallery ? [opened(gallery, tools, leave.signal)] : []));
    if (!gallery || place.hidden) return;
    window.scrollTo(0, 0);
    if (document.activeElement === document.body) focusOn(body);
  });
}

/** @param {GalleryPlace | null} gallery */
function tabsOf(gallery) {
  return html`<nav class="wizard-tabs" aria-label="Parts of the gallery">
    ${TABS.map(
      ({ name, title }) =>
        html`<a href=${galleryAddress(name)} id="to-${name}" aria-current=${name === gallery?.tab ? "page" : absent}>${title}</a>`,
    )}
  </nav>`;
}

/** @param {GalleryPlace} at @param {GalleryTools} tools @param {AbortSignal} signal */
function opened(at, tools, signal) {
  const tab = TABS.find(({ name }) => name === at.tab);
  if (tab) return tab.open(at, { ...tools, signal, follow: (reader) => tools.reader.follow(reader, signal) });
  const list = html`<a href=${GALLERY_ADDRESS}>To the datasets</a>`;
  return h("p", { class: "empty" }, html`There is no such page. ${list}.`);
}
