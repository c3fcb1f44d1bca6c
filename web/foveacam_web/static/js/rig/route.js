// Maps the rig page to its address, so that Back, reload and links work.

/** @import { Store } from "../store.js" */

export const RIG_ADDRESS = "#/rig";

/**
 * Keep the state equal to the address's fragment.
 * @param {Store} store
 */
export function followRigAddress(store) {
  const read = () => {
    const rig_page = location.hash === RIG_ADDRESS;
    if (rig_page !== store.state.rig_page) store.set({ rig_page });
  };
  window.addEventListener("hashchange", read);
  read();
}
