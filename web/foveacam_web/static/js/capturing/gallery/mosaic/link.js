// The link from a dataset to its mosaic, which says whether there is one and whether one can be made.

import { galleryAddress } from "../../../addresses.js";
import { absent, html } from "../../../elements/dom.js";
import { sentence } from "../../../elements/format.js";
import { Made } from "../made.js";

/**
 * @import { MosaicDocument, MosaicRequest } from "#api"
 * @import { GalleryContext } from "../page.js"
 */

/**
 * Return a function that shows the link.
 * @param {string} id of the dataset
 * @param {GalleryContext} context
 * @param {() => void} changed called when it has to be shown again
 */
export function makeMosaicLink(id, { commands, follow }, changed) {
  /** @type {Made<MosaicDocument, MosaicRequest>} */
  const mosaic = new Made(id, "mosaic", commands);
  mosaic.changed = changed;
  follow(mosaic);
  return () => {
    const { made = null, refusal = null } = mosaic.entry ?? {};
    const why = made ? null : refusal;
    return html`<a
      class="plain" href=${galleryAddress("datasets", id, "mosaic")} title=${why ? sentence(why.detail) : absent}
    >${why ? "Mosaic: not possible" : "Mosaic"}</a>`;
  };
}
