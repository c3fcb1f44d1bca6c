// The capture page has an address of its own, so that Back, reload and links work.

/** @typedef {import("../store.js").Store} Store */

export const CAPTURE_ADDRESS = "#/capture";

/**
 * Keep the state equal to the address.
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
 * Where the gallery shows a dataset.
 * @param {string} id
 */
export function datasetAddress(id) {
  return `#/gallery/datasets/${encodeURIComponent(id)}`;
}
