// Maps the planner to its address, which holds the plan, so that it can be shared.

/** @import { Store } from "../store.js" */

export const PLANNER_ADDRESS = "#/planner";

/**
 * Return the plan in the address as text; null when the address is another page's.
 * @returns {string | null}
 */
export function toldPlan() {
  const [page, words = ""] = location.hash.split("?");
  return page === PLANNER_ADDRESS ? words : null;
}

/**
 * Keep the state equal to the address's fragment.
 * @param {Store} store
 */
export function followPlannerAddress(store) {
  const read = () => {
    const planner_page = toldPlan() !== null;
    if (planner_page !== store.state.planner_page) store.set({ planner_page });
  };
  window.addEventListener("hashchange", read);
  read();
}

/**
 * Write a plan to the address without a new entry in the history.
 * @param {string} words
 */
export function tellPlan(words) {
  const address = words ? `${PLANNER_ADDRESS}?${words}` : PLANNER_ADDRESS;
  if (toldPlan() !== null && location.hash !== address) history.replaceState(null, "", address);
}
