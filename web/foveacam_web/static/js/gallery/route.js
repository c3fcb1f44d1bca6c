// Maps the gallery's pages to addresses, #/gallery/TAB[/ID[/PART]], so that Back, reload and links work.

/**
 * @import { GalleryPlace } from "#page"
 * @import { Store } from "../store.js"
 */

export const GALLERY_ADDRESS = "#/gallery";

/**
 * @param {string} tab
 * @param {string | null} [id]
 * @param {string | null} [part]
 */
export function galleryAddress(tab, id = null, part = null) {
  return [GALLERY_ADDRESS, tab, ...[id, part].filter((step) => step !== null).map(encodeURIComponent)].join("/");
}

/**
 * @param {string} hash
 * @returns {GalleryPlace | null} null when it is not an address of the gallery
 */
export function galleryAt(hash) {
  const [root, page, tab, id, part] = hash.split("/");
  if (`${root}/${page}` !== GALLERY_ADDRESS) return null;
  return { tab: tab || "datasets", id: plain(id), part: plain(part) };
}

/** @param {string | undefined} step */
function plain(step) {
  if (!step) return null;
  try {
    return decodeURIComponent(step);
  } catch {
    return step; // typed by hand: used as it is
  }
}

/**
 * Keep the state equal to the address's fragment.
 * @param {Store} store
 */
export function followGalleryAddress(store) {
  const read = () => {
    const gallery = galleryAt(location.hash);
    if (JSON.stringify(gallery) !== JSON.stringify(store.state.gallery)) store.set({ gallery });
  };
  window.addEventListener("hashchange", read);
  read();
}
