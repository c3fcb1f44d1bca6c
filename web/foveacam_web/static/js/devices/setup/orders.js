// Sends the orders of the set-up: changes of the draft one after the other, saving, undo, opening, tries.

import { outcome, request } from "../../transport/api.js";

/**
 * @import { DraftDocument, RigDraft, RigFileDocument, RigFiles, TryResult } from "#api"
 * @import { Commands, Store } from "#console"
 * @import { SetupReader } from "./reader.js"
 */

const OPEN_MS = 90_000; // devices that are missing take seconds each
const TRY_MS = 30_000;

/** The orders of one page. */
export class SetupOrders {
  #store;
  #commands;
  #reader;
  /** @type {Promise<unknown>} */
  #queue = Promise.resolve();

  /** @param {{store: Store, commands: Commands, reader: SetupReader}} context */
  constructor({ store, commands, reader }) {
    this.#store = store;
    this.#commands = commands;
    this.#reader = reader;
  }

  /**
   * Change the draft: at once here, then at the server, which answers its faults. Changes that come meanwhile are sent
   * together, and no read replaces them.
   * @param {(draft: RigDraft) => RigDraft} change
   */
  change(change) {
    const { setup } = this.#store.state;
    if (!setup) return Promise.resolve();
    this.#store.set({ setup: { ...setup, draft: change(setup.draft) } });
    this.#reader.changes.made += 1;
    const sent = this.#queue.then(() => this.#put());
    this.#queue = sent.catch(() => null);
    return sent;
  }

  async #put() {
    const { changes } = this.#reader;
    const draft = this.#store.state.setup?.draft;
    const made = changes.made;
    if (changes.sent === made || !draft) return;
    const setup = /** @type {DraftDocument | null} */ (
      await this.#commands.send("PUT", "/rig/setup/draft", { body: draft })
    );
    changes.sent = made;
    if (setup && changes.made === made) this.#store.set({ setup });
    await this.#reader.readDraft();
    if (setup) void this.#reader.readAdvice();
  }

  /**
   * Begin a new draft, from a file, or empty, or from the simulated rig.
   * @param {string | null} path
   * @param {boolean} [simulated]
   */
  async begin(path, simulated = false) {
    await this.#queue;
    const begun = await this.#commands.send("POST", "/rig/setup/draft", { body: { path, simulated } });
    if (begun) this.#store.set({ setup_begun_simulated: path === null ? simulated : null });
    await this.#reader.readDraft();
    void this.#reader.readAdvice();
  }

  async save() {
    await this.#queue;
    const saved = await this.#withHash("PUT", "/rig/setup/file");
    if (saved) this.#commands.notify({ tone: "good", title: "Saved", detail: saved.path });
  }

  async undo() {
    await this.#queue;
    const undone = await this.#withHash("POST", "/rig/setup/undo");
    if (undone) this.#commands.notify({ tone: "good", title: "The version before is back", detail: undone.path });
  }

  /** @param {"PUT" | "POST"} method @param {string} path @returns {Promise<RigFileDocument | null>} */
  async #withHash(method, path) {
    const hash = this.#store.state.setup_file?.hash ?? null;
    const answer = await this.#commands.send(method, path, { body: { hash } });
    await this.#reader.readDraft();
    return /** @type {RigFileDocument | null} */ (answer);
  }

  /**
   * Open the rig of a file in the place of the one that is open; null: the simulated one.
   * @param {string | null} path
   * @param {string | null} [scene] of the simulated rig; null: the present one
   */
  async open(path, scene = null) {
    this.#store.set({ start_dismissed: false, tries: {} });
    const opening = this.#commands.send("POST", "/rig/setup/open", { body: { path, scene }, patience_ms: OPEN_MS });
    setTimeout(() => void this.#reader.readStart(), 200);
    const files = /** @type {RigFiles | null} */ (await opening);
    if (files) this.#store.set({ setup_files: files });
    await Promise.all([this.#reader.readStart(), this.#reader.search()]);
  }

  /** Ask what answers on a port. @param {"controller" | "pan_tilt"} device */
  try(device) {
    return this.#tried(device, () => request("POST", "/rig/setup/tries", { body: { device }, patience_ms: TRY_MS }));
  }

  /** Move the mirrors a small step; takes control for it when it is free. */
  async stepMirrors() {
    const had = Boolean(this.#store.state.lease_token);
    if (!had) await this.#commands.takeLease("operator", false);
    if (!this.#store.state.lease_token) return;
    const options = { body: { confirmed: true }, headers: this.#commands.leaseHeader(), patience_ms: TRY_MS };
    await this.#tried("mirrors", () => request("POST", "/rig/setup/mirror_steps", options));
    if (!had) await this.#commands.giveLease();
  }

  /** @param {string} device @param {() => Promise<TryResult>} ask */
  async #tried(device, ask) {
    this.#setResult(device, "asking");
    await this.#queue; // the device that the page shows is asked
    const { answer, error } = await outcome(ask());
    this.#setResult(
      device,
      answer ?? { good: false, sentence: error?.message ?? "", remedy: error?.document.remedy ?? "" },
    );
  }

  /** @param {string} device @param {TryResult | "asking"} result */
  #setResult(device, result) {
    this.#store.set({ tries: { ...this.#store.state.tries, [device]: result } });
  }
}
