// Keeps the page's state equal to the server's: reads everything at each (re)connection, then follows the events.

import { request } from "./api.js";
import { listenToEvents } from "./eventlink.js";
import { withEvent } from "../operating/event_log.js";
import { newestFirst, QuietReads } from "./quiet.js";
import { signIn } from "./sign_in.js";

/**
 * @import { EventDocument, RigDocument, StopDocument } from "#api"
 * @import { Store } from "#console"
 * @import { Fixations } from "../looking/fixations.js"
 * @typedef {{readAll(): Promise<unknown>, onEvent(event: EventDocument): void, forget?(): void}} Reader reads what is its
 *   own; `forget`: called when its page is left
 */

const RIG_EVERY_MS = 2000;

/** Reads the server for one page. */
export class Sync {
  #store;
  #fixations;
  #reads = new QuietReads();
  #others;
  #stop_events = 0;

  /** @param {{store: Store, fixations: Fixations, others?: Reader[]}} context */
  constructor({ store, fixations, others = [] }) {
    this.#store = store;
    this.#fixations = fixations;
    this.#others = others;
    setInterval(() => document.hidden || store.state.stream !== "open" || void this.readRig(), RIG_EVERY_MS);
  }

  /** Read everything that a page with panels shows, and follow its changes. */
  followAll() {
    const link = listenToEvents((news) => {
      if (news.type === "event") this.#onEvent(news.event);
      else if (news.type === "signed_out") signIn.refuse();
      else {
        this.#store.set({ events_link: news.open ? "open" : "down" });
        if (news.open) void this.readAll();
      }
    });
    this.#store.on(["signed_out"], ({ signed_out }) => signed_out || link.again());
  }

  async readAll() {
    await Promise.all([
      this.readRig(),
      this.#readTargets(),
      this.#readClouds(),
      this.#readStop(),
      this.#readLease(),
      this.#readLog(),
      this.#reads.read("resume", () => this.#fixations.resume()),
      ...this.#others.map((other) => other.readAll()),
    ]);
  }

  readRig() {
    return this.#reads.read("rig", async () => {
      const rig = /** @type {RigDocument} */ (await request("GET", "/rig"));
      const known = this.#store.state.rig?.calibration?.id;
      this.#store.set({ rig });
      if (rig.calibration?.id !== known) this.#store.set({ intrinsics: rig.calibration?.wide ?? null });
    });
  }

  #readTargets() {
    return this.#reads.keep(this.#store, "targets", "/targets", newestFirst);
  }

  #readClouds() {
    return this.#reads.keep(this.#store, "clouds", "/clouds", newestFirst);
  }

  #readStop() {
    return this.#reads.read("stop", async () => {
      const before = this.#stop_events;
      const stop = /** @type {StopDocument} */ (await request("GET", "/stop"));
      if (before === this.#stop_events) this.#store.set({ stop }); // else an event has brought a newer state
    });
  }

  #readLease() {
    return this.#reads.keep(this.#store, "lease", "/lease");
  }

  #readLog() {
    return this.#reads.read("log", async () => {
      const events = /** @type {EventDocument[]} */ (await request("GET", "/events/recent?limit=100"));
      let log = this.#store.state.log;
      for (const event of events) log = withEvent(log, event);
      this.#store.set({ log });
    });
  }

  /**
   * The event carries the whole state, and an event of the rig's state follows. If every page read it, a dozen of them
   * would delay the next command.
   * @param {EventDocument} event
   */
  #onStop({ data }) {
    const stop = /** @type {StopDocument | undefined} */ (data?.["stop"]);
    if (stop) {
      this.#stop_events += 1;
      this.#store.set({ stop });
    } else void this.#readStop();
  }

  /** @param {EventDocument} event */
  #onEvent(event) {
    this.#store.set({ log: withEvent(this.#store.state.log, event) });
    this.#fixations.onEvent(event);
    for (const other of this.#others) other.onEvent(event);
    const subject = event.kind.split(".")[0];
    if (subject === "target") void this.#readTargets();
    else if (subject === "cloud") void this.#readClouds();
    else if (subject === "stop") this.#onStop(event);
    else if (subject === "lease") void this.#readLease();
    else if (subject === "rig" || subject === "device" || subject === "camera" || subject === "mirrors")
      void this.readRig();
  }
}
