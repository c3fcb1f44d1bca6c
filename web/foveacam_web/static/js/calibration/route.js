// Maps the pages of the wizard to addresses, so that Back, reload and links work.

/**
 * @import { WizardPage } from "#page"
 * @import { Store } from "../store.js"
 */

/** @type {{page: WizardPage, title: string}[]} */
export const PAGES = [
  { page: "overview", title: "Overview" },
  { page: "wide", title: "1 Wide camera" },
  { page: "mirrors", title: "2 Mirrors" },
  { page: "fit", title: "3 Rectify" },
  { page: "check", title: "4 Check" },
  { page: "settle", title: "Settle" },
];

/**
 * Return the address of a page of the wizard; null gives the console's.
 * @param {WizardPage | null} page
 */
export function addressOf(page) {
  return page === null ? "#/" : page === "overview" ? "#/calibration" : `#/calibration/${page}`;
}

/**
 * @param {string} hash
 * @returns {WizardPage | null}
 */
export function pageAt(hash) {
  const found = /^#\/calibration(?:\/(\w+))?$/.exec(hash);
  if (!found) return null;
  return PAGES.find(({ page }) => page === found[1])?.page ?? "overview";
}

/** @param {WizardPage | null} page */
export function go(page) {
  location.hash = addressOf(page);
}

/**
 * Keep the state equal to the address's fragment.
 * @param {Store} store
 */
export function followAddress(store) {
  const read = () => {
    const wizard = pageAt(location.hash);
    if (wizard !== store.state.wizard) store.set({ wizard });
  };
  window.addEventListener("hashchange", read);
  read();
}
