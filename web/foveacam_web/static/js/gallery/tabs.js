// The gallery's tabs. A tab is one entry: `name` stands in the address, `title` on the tab, and `open` makes what is
// shown at an address of it, each time that one goes there:
//
//   open({ tab, id, part }, context) → HTMLElement
//
// `id` is null for the list of all. What `open` starts must end with `context.signal`, which is aborted when somebody
// leaves: `store.on(keys, listener, signal)`, `addEventListener(…, { signal })`, and `context.follow(reader)`, which
// reads at once and after each reconnection, and hears the server's events. More pages about one dataset are entries
// of dataset_parts.js, in the same form.

import { openDatasets } from "./datasets.js";
import { openRecordings } from "./recordings.js";
import { openStills } from "./stills.js";

/**
 * What the gallery hands to a page that it opens; `signal`: aborted when the operator leaves the page.
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
