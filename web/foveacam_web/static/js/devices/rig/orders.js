// Sends commands to the rig's devices. The refusal of a camera setting is returned, so that it is shown beside its
// control.

/**
 * @import { BinningRequest, CameraPatch, CamerasChangedDocument, JobDocument, MirrorsDocument } from "#api"
 * @import { RailDocument, RigBinningDocument, SimulatedFaults } from "#api"
 * @import { Commands, Role, Store } from "#console"
 * @import { RigReader } from "./reader.js"
 * @typedef {{changed: CamerasChangedDocument | null, refusal: string | null}} Answer `refusal`: why a camera refused it
 */

const CAMERA_MS = 30_000; // the camera is stopped, set and started again

/** The device commands of one page. */
export class RigOrders {
  #store;
  #commands;
  #reader;
  /** @type {Promise<unknown>} */
  #queue = Promise.resolve();

  /** @param {{store: Store, commands: Commands, reader: RigReader}} context */
  constructor({ store, commands, reader }) {
    this.#store = store;
    this.#commands = commands;
    this.#reader = reader;
  }

  /**
   * Change a camera's settings; `linked`: change both foveae or neither.
   * @param {Role} role
   * @param {CameraPatch} patch
   * @param {boolean} linked
   * @returns {Promise<Answer>}
   */
  change(role, patch, linked) {
    return this.#inTurn(() => this.#camera("PATCH", `/cameras/${role}`, { ...patch, linked }));
  }

  /**
   * Change the working binning of all cameras.
   * @param {1 | 2} working_binning
   * @returns {Promise<string | null>} why it was not changed; null where it was
   */
  chooseBinning(working_binning) {
    return this.#inTurn(async () => {
      const binning = await this.#set("PUT", "/rig/binning", /** @type {BinningRequest} */ ({ working_binning }));
      const { rig } = this.#store.state;
      if (rig && binning.answer)
        this.#store.set({ rig: { ...rig, binning: /** @type {RigBinningDocument} */ (binning.answer) } });
      return binning.error?.message ?? null;
    });
  }

  /** Reset a camera to the settings of the rig file. @param {Role} role */
  async reset(role) {
    const { refusal } = await this.#inTurn(() => this.#camera("DELETE", `/cameras/${role}/settings`, undefined));
    if (refusal) this.#commands.notify({ tone: "warn", title: "Not reset", detail: refusal });
  }

  /**
   * Change cameras one after the other, so that the last response is the newest state.
   * @template T
   * @param {() => Promise<T>} act
   */
  #inTurn(act) {
    const order = this.#queue.then(act);
    this.#queue = order.catch(() => null);
    return order;
  }

  /**
   * @param {"PATCH" | "DELETE"} method
   * @param {string} path
   * @param {object | undefined} body
   * @returns {Promise<Answer>}
   */
  async #camera(method, path, body) {
    const { answer, error } = await this.#set(method, path, body);
    const changed = /** @type {CamerasChangedDocument | null} */ (answer);
    if (changed) this.#adopt(changed);
    return { changed, refusal: error?.message ?? null };
  }

  /**
   * Change settings of cameras; after a refusal read the rig again, so that the page shows the values in force.
   * @param {"PUT" | "PATCH" | "DELETE"} method
   * @param {string} path
   * @param {object | undefined} body
   */
  async #set(method, path, body) {
    const options = { body, patience_ms: CAMERA_MS };
    const found = await this.#commands.tried(method, path, {
      ...options,
      shows: ({ document }) => document.status !== 422,
    });
    if (found.error) void this.#reader.readRig();
    return found;
  }

  /** @param {CamerasChangedDocument} changed */
  #adopt({ cameras, divergence }) {
    const { rig } = this.#store.state;
    if (!rig) return;
    const now = new Map(cameras.map((camera) => [camera.role, camera]));
    this.#store.set({
      rig: { ...rig, cameras: rig.cameras.map((camera) => now.get(camera.role) ?? camera), divergence },
    });
  }

  /** Test both triggers. */
  async testTriggers() {
    const job = /** @type {JobDocument | null} */ (await this.#commands.send("POST", "/cameras/self_tests"));
    if (job) this.#reader.tests.follow(job);
  }

  cancelTest() {
    return this.#reader.tests.cancel(this.#commands);
  }

  /** Restart both DACs. */
  async recover() {
    const done = await this.#mirrors("/mirrors/recover");
    if (done)
      this.#commands.notify({
        tone: "good",
        title: "The mirrors' DACs were restarted",
        detail: "Both mirrors are back at their commanded position.",
      });
  }

  /** Bring both mirrors to rest. */
  async park() {
    await this.#mirrors("/mirrors/park");
  }

  /** @param {boolean} on */
  async enable(on) {
    await this.#mirrors(on ? "/mirrors/enable" : "/mirrors/disable");
  }

  /** @param {string} path */
  async #mirrors(path) {
    const mirrors = /** @type {MirrorsDocument | null} */ (await this.#commands.send("POST", path));
    const { rig } = this.#store.state;
    if (mirrors && rig) this.#store.set({ rig: { ...rig, mirrors } });
    return mirrors;
  }

  /** @param {{place: string} | {position_mm: number}} body */
  slide(body) {
    return this.#rail("/rail/moves", body);
  }

  /** Stop the rail at once. */
  holdRail() {
    return this.#rail("/rail/holds");
  }

  /** Set these faults in the simulated rig, and clear all others. @param {SimulatedFaults} faults */
  breakIt(faults) {
    return this.#faults("PUT", faults);
  }

  mend() {
    return this.#faults("DELETE");
  }

  /** @param {"PUT" | "DELETE"} method @param {SimulatedFaults} [body] */
  async #faults(method, body) {
    const faults = await this.#commands.send(method, "/simulation/faults", { body });
    if (faults) this.#reader.showFaults(/** @type {SimulatedFaults} */ (faults));
    else await this.#reader.readFaults(); // a checkbox whose change was refused goes back
  }

  homeRail() {
    return this.#rail("/rail/homings");
  }

  confirmRailZero() {
    return this.#rail("/rail/zero_confirmations");
  }

  /** @param {string} path @param {object} [body] */
  async #rail(path, body) {
    const rail = /** @type {RailDocument | null} */ (await this.#commands.send("POST", path, { body }));
    if (rail) this.#store.set({ rail });
    await this.#reader.readRail();
  }
}
