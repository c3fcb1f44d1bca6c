// Keeps a display registered at the server, and receives its pattern by events and by each registration's answer.

import { RequestError, request } from "../../transport/api.js";
import { listenToEvents } from "../../transport/eventlink.js";
import { QuietReads } from "../../transport/quiet.js";

/** @import { DisplayRequest, PatternDocument } from "#api" */

const EVERY_MS = 5000; // the server forgets a display after 15 s

/** One display's link to the server. */
export class Link {
  #id = [...crypto.getRandomValues(new Uint8Array(6))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
  #reads = new QuietReads();
  /** @type {import("../../transport/eventsource.js").EventLink | null} */
  #events = null;
  #online = false;
  #described;
  #shows;
  #onState;

  /**
   * @param {{described: () => DisplayRequest, shows: (shown: PatternDocument) => void,
   *   onState: (online: boolean, why: string) => void}} context `why`: what the server refused, empty when it is away
   */
  constructor({ described, shows, onState }) {
    this.#described = described;
    this.#shows = shows;
    this.#onState = onState;
  }

  /** Register, and again before the server forgets; leave when the page does. */
  begin() {
    this.#events = listenToEvents((news) => {
      if (news.type === "link" ? news.open : news.type === "event" && news.event.kind === "display.pattern")
        void this.register();
    });
    setInterval(() => void this.register(), EVERY_MS);
    addEventListener("pagehide", () => void request("DELETE", this.#path, { keepalive: true }).catch(() => {}));
    addEventListener("pageshow", (event) => event.persisted && void this.register());
    void this.register();
  }

  /** Register, or say that it is still there; show what the server answers. */
  register() {
    return this.#reads.read("display", async () => {
      try {
        const body = this.#described();
        this.#shows(/** @type {PatternDocument} */ (await request("PUT", this.#path, { body })));
        if (!this.#online) this.#events?.again(); // it may have been signed out
        this.#setOnline(true, "");
      } catch (error) {
        if (!(error instanceof RequestError)) throw error;
        this.#setOnline(false, error.document.status > 0 ? ` (${error.document.title})` : "");
      }
    });
  }

  /** @param {boolean} online @param {string} why */
  #setOnline(online, why) {
    this.#online = online;
    this.#onState(online, why);
  }

  get #path() {
    return `/displays/${this.#id}`;
  }
}
