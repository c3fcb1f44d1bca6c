// The planner has an address of its own, which tells the plan as well: it can be sent to somebody.

/** @typedef {import("../store.js").Store} Store */

export const PLANNER_ADDRESS = "#/planner";

/**
 * What the address tells of a plan; null: it is another page's.
 * @returns {string | null}
 */
export function toldPlan() {
  const [page, words = ""] = location.hash.split("?");
  return page === PLANNER_ADDRESS ? words : null;
}

/**
 * Keep the state equal to the address.
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
 * Let the address tell this plan; Back goes to where one came from all the same.
 * @param {string} words
 */
export function tellPlan(words) {
  const address = words ? `${PLANNER_ADDRESS}?${words}` : PLANNER_ADDRESS;
  if (toldPlan() !== null && location.hash !== address) history.replaceState(null, "", address);
}
