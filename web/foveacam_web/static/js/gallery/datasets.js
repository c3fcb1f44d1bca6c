// Opens the datasets tab: the list, one dataset, or a further page about one.

import { DATASET_PARTS } from "./dataset_parts.js";
import { openDataset } from "./dataset_page.js";
import { openList } from "./datasets_list.js";

/**
 * @import { GalleryPlace } from "#page"
 * @import { GalleryContext } from "./tabs.js"
 */

/**
 * @param {GalleryPlace} at
 * @param {GalleryContext} context
 * @returns {HTMLElement}
 */
export function openDatasets(at, context) {
  if (at.id === null) return openList(context);
  const part = DATASET_PARTS.find(({ name }) => name === at.part);
  return part ? part.open(at, context) : openDataset(at.id, context);
}
