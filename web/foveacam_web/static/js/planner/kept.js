// What this browser keeps of the planner: the last plan, and a map of one's own, which no address could hold.

/** @typedef {import("#page").GivenMap} GivenMap */

const PLAN_KEY = "foveacam.planner";
const MAP_KEY = "foveacam.planner.map";

/** @returns {string} the last plan, as the address would tell it */
export function keptPlan() {
  try {
    return localStorage.getItem(PLAN_KEY) ?? "";
  } catch {
    return ""; // private mode: the first plan is always good
  }
}

/** @param {string} words */
export function keepPlan(words) {
  try {
    localStorage.setItem(PLAN_KEY, words);
  } catch {
    // private mode: the address has it all the same
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
    localStorage.removeItem(MAP_KEY); // a map that is too large must not leave the one before in its place
    localStorage.setItem(MAP_KEY, JSON.stringify(given));
  } catch {
    // too large for this browser, or private mode: it lasts until the page closes
  }
}
