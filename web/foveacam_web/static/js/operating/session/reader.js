// Reads who this browser is to the server, and signs it out.

import { whoAmI } from "../../transport/api.js";
import { QuietReads } from "../../transport/quiet.js";
import { signIn } from "../../transport/sign_in.js";

/**
 * @import { Commands, Store } from "#console"
 */

/** The sign-in of one page. */
export class SessionReader {
  #store;
  #commands;
  #reads = new QuietReads();

  /** @param {{store: Store, commands: Commands}} context */
  constructor({ store, commands }) {
    this.#store = store;
    this.#commands = commands;
  }

  readAll() {
    return this.#reads.read("session", async () => {
      const sign_in = await whoAmI();
      if (sign_in.kind === "nobody") return signIn.refuse();
      signIn.restore();
      this.#store.set({ sign_in });
    });
  }

  onEvent() {}

  /** Sign this browser out and show the sign-in page. */
  async signOut() {
    if (await this.#commands.send("DELETE", "/session")) location.reload();
  }
}
