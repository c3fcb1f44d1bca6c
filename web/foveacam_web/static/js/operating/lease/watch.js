// Reports requests for the lease that this page holds, and takes the lease that is handed over to this page.

import { holderName } from "./words.js";

/**
 * @import { LeaseDocument } from "#api"
 * @import { Commands, Store } from "#console"
 */

const STAY_MS = 20_000;

/** @param {{store: Store, commands: Commands}} context */
export function watchLease({ store, commands }) {
  /** @type {LeaseDocument | null} */
  let before = null;
  store.on(["lease"], ({ lease, lease_token }) => {
    if (lease_token && lease?.asked_by && lease.asked_by !== before?.asked_by)
      commands.notify({
        tone: "info",
        title: `${lease.asked_by} asks for control`,
        detail: "It stays yours until you hand it over.",
        action: { label: "Hand over", act: () => commands.answerLease(true) },
        stay_ms: STAY_MS,
      });
    before = lease;
    answerOf(store, commands);
  });
}

/** Act on the answer to this page's request for the lease. @param {Store} store @param {Commands} commands */
function answerOf(store, commands) {
  const { lease, lease_token, lease_asked, sign_in } = store.state;
  if (!lease_asked || !lease || lease_token || lease.asked_by) return;
  store.set({ lease_asked: false });
  if (!lease.holder) void commands.takeLease(holderName(sign_in), false);
  else commands.notify({ tone: "info", title: "Control was not handed over", detail: `${lease.holder} keeps it.` });
}
