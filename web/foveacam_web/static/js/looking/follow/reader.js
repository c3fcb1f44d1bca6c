// Keeps the followed targets equal to the server's: twice a second while they are shown, and at each event.

import { galleryAddress } from "../../addresses.js";
import { request } from "../../transport/api.js";
import { QuietReads } from "../../transport/quiet.js";
import { endedMessage } from "./words.js";

/**
 * @import { EventDocument, TrailPoint } from "#api"
 * @import { Commands, FollowEnded, FollowRoundTaken, Store } from "#console"
 */

const READ_MS = 500;
const TRAIL_MS = 1000;
const TOGETHER_MS = 150; // a stop ends all targets at once: one message for all

/** The reads of followed targets of one page. */
export class FollowReader {
  #store;
  #commands;
  #reads = new QuietReads();
  /** @type {FollowEnded[]} */
  #ended = [];

  /** @param {{store: Store, commands: Commands}} context */
  constructor({ store, commands }) {
    this.#store = store;
    this.#commands = commands;
    store.on(["follow_page", "follow_tab"], () => this.#shows && void this.readAll());
    setInterval(() => this.#shows && this.#some && void this.readFollowed(), READ_MS);
    setInterval(() => store.state.follow_page && !document.hidden && void this.readTrails(), TRAIL_MS);
  }

  get #shows() {
    const { follow_page, follow_tab, stream } = this.#store.state;
    return (follow_page || follow_tab) && stream === "open" && !document.hidden;
  }

  get #some() {
    return (this.#store.state.followed ?? []).length > 0;
  }

  async readAll() {
    await this.readFollowed();
    if (this.#store.state.follow_page) await this.readTrails();
  }

  readFollowed() {
    return this.#reads.keep(this.#store, "followed", "/follows");
  }

  readTrails() {
    const ids = (this.#store.state.followed ?? []).map(({ id }) => id);
    return this.#reads.read("trails", async () => {
      const read = async (/** @type {string} */ id) =>
        /** @type {[string, TrailPoint[]]} */ ([id, await request("GET", `/follows/${id}/trail`)]);
      this.#store.set({ trails: Object.fromEntries(await Promise.all(ids.map(read))) });
    });
  }

  /** @param {EventDocument} event */
  onEvent(event) {
    if (!event.kind.startsWith("follow.")) return;
    void this.readFollowed();
    if (event.kind === "follow.round")
      this.#round(/** @type {FollowRoundTaken} */ (/** @type {unknown} */ (event.data)));
    if (event.level === "info") return;
    if (event.kind === "follow.ended") this.#end(/** @type {FollowEnded} */ (/** @type {unknown} */ (event.data)));
    else if (event.kind === "follow.refused")
      this.#commands.notify({ tone: "warn", title: "The tracker was not changed", detail: event.message });
  }

  /** @param {FollowRoundTaken} data */
  #round({ capture_id, name, targets }) {
    this.#commands.notify({
      tone: "good",
      title: `${name} is stored`,
      detail: targets === 1 ? "One look at the followed target." : `One look at each of ${targets} followed targets.`,
      action: { label: "Show it in the gallery", act: () => (location.hash = galleryAddress("datasets", capture_id)) },
    });
  }

  /** @param {FollowEnded} data */
  #end(data) {
    this.#ended.push(data);
    if (this.#ended.length > 1) return; // part of the first one's message
    setTimeout(() => {
      const message = endedMessage(this.#ended);
      this.#ended = [];
      if (message) this.#commands.notify(message);
    }, TOGETHER_MS);
  }
}
