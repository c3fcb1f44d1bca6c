// Lists the further pages about one dataset, at #/gallery/datasets/ID/PART, one entry each, in the form of the
// gallery's tabs (tabs.js). The dataset's own page links to them by their titles.

import { openMosaic } from "./mosaic.js";

/** @import { GalleryTab } from "./tabs.js" */

/** @type {readonly GalleryTab[]} */
export const DATASET_PARTS = Object.freeze([{ name: "mosaic", title: "Mosaic", open: openMosaic }]);
