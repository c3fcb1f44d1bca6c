// Saves the planner's state in this browser: the last plan, and the user's own map, which is too long for an address.

/** @import { GivenMap } from "#page" */

const PLAN_KEY = "foveacam.planner";
const MAP_KEY = "foveacam.planner.map";

/** @returns {string} the last plan, as it is written in an address */
export function keptPlan() {
  try {
    return localStorage.getItem(PLAN_KEY) ?? "";
  } catch {
    return ""; // private mode: use the default plan
  }
}

/** @param {string} words */
export function keepPlan(words) {
  try {
    localStorage.setItem(PLAN_KEY, words);
  } catch {
    // private mode: the address still holds the plan
  }
}

/** @returns {GivenMap | null} */
export function keptMap() {
  try {
    return JSON.parse(localStorage.getItem(MAP_KEY) ?? "null");
  } catch {
    return null; // a damaged entry
  }
}

/** @param {GivenMap} given */
export function keepMap(given) {
  try {
    localStorage.removeItem(MAP_KEY); // when the new map is too large, the old one must not stay
    localStorage.setItem(MAP_KEY, JSON.stringify(given));
  } catch {
    // too large for this browser, or private mode: the map lasts until the page closes
  }
}
