// Maps the capture page to its address, so that Back, reload and links work.

/** @import { Store } from "../store.js" */

export const CAPTURE_ADDRESS = "#/capture";

/**
 * Keep the state equal to the address's fragment.
 * @param {Store} store
 */
export function followCaptureAddress(store) {
  const read = () => {
    const capture_page = location.hash === CAPTURE_ADDRESS;
    if (capture_page !== store.state.capture_page) store.set({ capture_page });
  };
  window.addEventListener("hashchange", read);
  read();
}

/**
 * Return the gallery's address of a dataset.
 * @param {string} id
 */
export function datasetAddress(id) {
  return `#/gallery/datasets/${encodeURIComponent(id)}`;
}
