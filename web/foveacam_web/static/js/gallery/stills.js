// Opens the stills tab: the list, or one still.

import { openStill } from "./still_page.js";
import { openStillsList } from "./stills_list.js";

/**
 * @param {import("#page").GalleryPlace} at
 * @param {import("./tabs.js").GalleryContext} context
 * @returns {HTMLElement}
 */
export function openStills(at, context) {
  return at.id === null ? openStillsList(context) : openStill(at.id, context);
}
