// Keeps the set-up equal to the server's: the draft and its file at each event, devices and advice when asked, the
// steps of the start while the rig opens.

import { request, RequestError } from "../../transport/api.js";
import { QuietReads } from "../../transport/quiet.js";

/**
 * @import { AdviceDocument, DraftDocument, EventDocument, FoundDevices, RigFileDocument, RigFiles, StartDocument } from "#api"
 * @import { Store } from "#console"
 */

const START_MS = 400;
const SEARCH_MS = 60_000; // every bus is searched, and each may take seconds

/** The reads of one page. */
export class SetupReader {
  #store;
  #reads = new QuietReads();
  /** Number of changes of the draft made on this page, and number of those that the server has answered. */
  changes = { made: 0, sent: 0 };

  /** @param {Store} store */
  constructor(store) {
    this.#store = store;
    let state = "";
    store.on(["rig"], ({ rig }) => {
      if (!rig || rig.state === state) return;
      if (rig.state === "opening") store.set({ start_dismissed: false });
      state = rig.state;
      void this.readStart();
    });
    store.on(["setup_page"], ({ setup_page }) => {
      if (!setup_page) return;
      void this.readAll();
      if (!store.state.found) void this.search();
    });
  }

  async readAll() {
    await Promise.all([this.readStart(), this.readDraft()]);
  }

  /** Read the steps of the start, repeatedly while the rig opens. */
  readStart() {
    const read = async () => {
      if (this.#store.state.stream === "down") return;
      this.#store.set({ start: /** @type {StartDocument} */ (await request("GET", "/rig/start")) });
    };
    return this.#reads.repeat("start", read, () => {
      const steps = this.#store.state.start?.steps ?? [];
      return steps.some(({ state }) => state === "pending" || state === "active") ? START_MS : null;
    });
  }

  /** Read the draft, its file and the list of files. */
  readDraft() {
    if (!this.#store.state.setup_page) return Promise.resolve();
    return this.#reads.read("draft", async () => {
      const { made, sent } = this.changes;
      try {
        const [setup, setup_file, setup_files] = await Promise.all([
          /** @type {Promise<DraftDocument>} */ (request("GET", "/rig/setup/draft")),
          /** @type {Promise<RigFileDocument>} */ (request("GET", "/rig/setup/file")),
          /** @type {Promise<RigFiles>} */ (request("GET", "/rig/setup/files")),
        ]);
        const older = sent !== made || this.changes.made !== made; // than a change of this page
        this.#store.set({ ...(older ? {} : { setup }), setup_file, setup_files, setup_problem: "" });
      } catch (error) {
        if (!(error instanceof RequestError) || error.document.status !== 422) throw error;
        this.#store.set({ setup_problem: error.message }); // the file was made unreadable by hand
      }
    });
  }

  /** Search every bus, then ask for advice. */
  search() {
    return this.#reads
      .read("found", async () => {
        this.#store.set({ searching: true });
        this.#store.set({
          found: /** @type {FoundDevices} */ (await request("GET", "/rig/setup/devices", { patience_ms: SEARCH_MS })),
        });
        await this.readAdvice();
      })
      .finally(() => this.#store.set({ searching: false }));
  }

  readAdvice() {
    return this.#reads.read("advice", async () => {
      this.#store.set({
        advice: /** @type {AdviceDocument[]} */ (await request("GET", "/rig/setup/advice", { patience_ms: SEARCH_MS })),
      });
    });
  }

  /** @param {EventDocument} event */
  onEvent(event) {
    if (event.kind === "rig.setup") void this.readDraft();
    if (event.kind === "device.recovered" || event.kind === "device.fault") void this.readStart();
  }
}
