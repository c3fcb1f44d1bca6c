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

/** @typedef {import("./context.js").GalleryTab} GalleryTab */

/** @type {readonly GalleryTab[]} */
export const TABS = Object.freeze([
  { name: "datasets", title: "Datasets", open: openDatasets },
  { name: "recordings", title: "Recordings", open: openRecordings },
  { name: "stills", title: "Stills", open: openStills },
]);
