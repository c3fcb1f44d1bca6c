// Maps the pages over the console to addresses, so that Back, reload and links work. Pure functions.

/** @import { ConsoleState, GalleryPlace, PeopleTab, RigTab, WizardPage } from "#page" */

export const CONSOLE_ADDRESS = "#/";
export const RIG_ADDRESS = "#/rig";
export const SETUP_ADDRESS = "#/setup";
export const SETTINGS_ADDRESS = "#/settings";
export const CAPTURE_ADDRESS = "#/capture";
export const FOLLOW_ADDRESS = "#/follow";
export const LOOP_ADDRESS = "#/loop";
export const GALLERY_ADDRESS = "#/gallery";
export const PLANNER_ADDRESS = "#/planner";
export const COMPARE_ADDRESS = "#/compare";
export const ENGINE_ADDRESS = "#/engine";
export const RIGS_ADDRESS = "#/rigs";
export const PEOPLE_ADDRESS = "#/people";
export const ACCEPTANCE_ADDRESS = "#/acceptance";

/** @type {{page: WizardPage, title: string}[]} */
export const WIZARD_PAGES = [
  { page: "overview", title: "Overview" },
  { page: "wide", title: "1 Wide camera" },
  { page: "mirrors", title: "2 Mirrors" },
  { page: "fit", title: "3 Rectify" },
  { page: "check", title: "4 Check" },
  { page: "settle", title: "Settle" },
];

/** @type {PeopleTab[]} */
const PEOPLE_PARTS = ["services", "sign_ins", "log"];

/**
 * Return which page an address opens; null and false for all others.
 * @param {string} hash
 * @returns {Pick<ConsoleState, "wizard" | "rig_page" | "setup_page" | "settings_page" | "capture_page" | "follow_page" | "loop_page" | "gallery" | "planner_page" | "compare_page" | "engine_page" | "rigs_page" | "acceptance_page" | "people">}
 */
export function pagesAt(hash) {
  return {
    wizard: wizardAt(hash),
    rig_page: rigTabAt(hash),
    setup_page: hash === SETUP_ADDRESS,
    settings_page: hash === SETTINGS_ADDRESS,
    capture_page: hash === CAPTURE_ADDRESS,
    follow_page: hash === FOLLOW_ADDRESS,
    loop_page: hash === LOOP_ADDRESS,
    gallery: galleryAt(hash),
    planner_page: planAt(hash) !== null,
    compare_page: hash === COMPARE_ADDRESS,
    engine_page: hash === ENGINE_ADDRESS,
    rigs_page: hash === RIGS_ADDRESS,
    acceptance_page: hash === ACCEPTANCE_ADDRESS,
    people: peopleAt(hash),
  };
}

/** @type {{tab: RigTab, title: string}[]} */
export const RIG_TABS = [
  { tab: "cameras", title: "Cameras" },
  { tab: "mirrors", title: "Mirrors" },
  { tab: "positioners", title: "Pan-tilt and rail" },
  { tab: "faults", title: "Faults" },
];

/** @param {RigTab} tab */
export function rigAddress(tab) {
  return tab === "cameras" ? RIG_ADDRESS : `${RIG_ADDRESS}/${tab}`;
}

/** @param {string} hash @returns {RigTab | null} */
export function rigTabAt(hash) {
  const found = /^#\/rig(?:\/(\w+))?$/.exec(hash);
  return found && (RIG_TABS.find(({ tab }) => tab === found[1])?.tab ?? "cameras");
}

/** @param {WizardPage} page */
export function wizardAddress(page) {
  return page === "overview" ? "#/calibration" : `#/calibration/${page}`;
}

/** @param {string} hash @returns {WizardPage | null} */
export function wizardAt(hash) {
  const found = /^#\/calibration(?:\/(\w+))?$/.exec(hash);
  return found && (WIZARD_PAGES.find(({ page }) => page === found[1])?.page ?? "overview");
}

/**
 * Return the address of a page of the gallery: #/gallery/TAB[/ID[/PART]].
 * @param {string} tab
 * @param {string | null} [id]
 * @param {string | null} [part]
 */
export function galleryAddress(tab, id = null, part = null) {
  return [GALLERY_ADDRESS, tab, ...[id, part].filter((step) => step !== null).map(encodeURIComponent)].join("/");
}

/** @param {string} hash @returns {GalleryPlace | null} */
export function galleryAt(hash) {
  const [root, page, tab, id, part] = hash.split("/");
  if (`${root}/${page}` !== GALLERY_ADDRESS) return null;
  return { tab: tab || "datasets", id: decoded(id), part: decoded(part) };
}

/** @param {string | undefined} step @returns {string | null} */
export function decoded(step) {
  if (!step) return null;
  try {
    return decodeURIComponent(step);
  } catch {
    return step; // typed by hand: used as it is
  }
}

/** @param {PeopleTab} tab */
export function peopleAddress(tab) {
  return tab === "people" ? PEOPLE_ADDRESS : `${PEOPLE_ADDRESS}/${tab}`;
}

/** @param {string} hash @returns {PeopleTab | null} */
export function peopleAt(hash) {
  const found = /^#\/people(?:\/(\w+))?$/.exec(hash);
  return found && (PEOPLE_PARTS.find((tab) => tab === found[1]) ?? "people");
}

/** Return the plan that the planner's address contains as text. @param {string} hash @returns {string | null} */
export function planAt(hash) {
  const [page, words = ""] = hash.split("?");
  return page === PLANNER_ADDRESS ? words : null;
}
