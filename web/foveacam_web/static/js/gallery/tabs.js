// Lists the gallery's tabs, one entry each: `name` is in the address, `title` on the tab, and `open` builds the page of
// an address each time it is visited:
//
//   open({ tab, id, part }, context) → HTMLElement
//
// `id` is null for the list. Everything that `open` starts must end with `context.signal`, which is aborted when the
// page is left: `store.on(keys, listener, signal)`, `addEventListener(…, { signal })`, and `context.follow(reader)`,
// which reads at once and after each reconnection, and receives the server's events. Further pages about one dataset
// are entries of dataset_parts.js, in the same form.

import { openDatasets } from "./datasets.js";
import { openRecordings } from "./recordings.js";
import { openStills } from "./stills.js";

/**
 * What the gallery gives to a page that it opens; `signal`: aborted when the operator leaves the page.
 * @typedef {{
 *   store: import("../store.js").Store,
 *   commands: import("../commands.js").Commands,
 *   signal: AbortSignal,
 *   follow: (reader: import("../sync.js").Reader) => void,
 * }} GalleryContext
 * @typedef {{
 *   name: string,
 *   title: string,
 *   open: (at: import("#page").GalleryPlace, context: GalleryContext) => HTMLElement,
 * }} GalleryTab
 */

/** @type {readonly GalleryTab[]} */
export const TABS = Object.freeze([
  { name: "datasets", title: "Datasets", open: openDatasets },
  { name: "recordings", title: "Recordings", open: openRecordings },
  { name: "stills", title: "Stills", open: openStills },
]);
