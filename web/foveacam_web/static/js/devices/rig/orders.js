// Sends commands to the rig's devices. The refusal of a camera setting is returned, so that it is shown beside its
// control.

import { remedyOf } from "../../elements/format.js";
import { RequestError, request } from "../../transport/api.js";
import { hasEnded } from "../../transport/jobs.js";

/**
 * @import { BinningRequest, CameraPatch, CamerasChangedDocument, JobDocument, MirrorsDocument } from "#api"
 * @import { RailDocument, RigBinningDocument, SimulatedFaults } from "#api"
 * @import { Role } from "#page"
 * @import { Commands } from "../../commands.js"
 * @import { Store } from "../../store.js"
 * @import { RigReader } from "./reader.js"
 * @typedef {{changed: CamerasChangedDocument | null, refusal: string | null}} Answer `refusal`: why a camera did not take it
 */

const CAMERA_MS = 30_000; // the camera is stopped, set and started again
const LOOK_MS = 300;

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
      const body = /** @type {BinningRequest} */ ({ working_binning });
      try {
        const binning = /** @type {RigBinningDocument} */ (
          await request("PUT", "/rig/binning", { body, headers: this.#commands.leaseHeader(), patience_ms: CAMERA_MS })
        );
        const { rig } = this.#store.state;
        if (rig) this.#store.set({ rig: { ...rig, binning } });
        return null;
      } catch (error) {
        if (!(error instanceof RequestError)) throw error;
        if (error.document.status !== 422) await this.#commands.attempt(() => Promise.reject(error));
        void this.#reader.readRig();
        return error.message;
      }
    });
  }

  /** Reset a camera to the settings of the rig file. @param {Role} role */
  async reset(role) {
    const { refusal } = await this.#inTurn(() => this.#camera("DELETE", `/cameras/${role}/settings`, undefined));
    if (refusal) this.#commands.say({ tone: "warn", title: "Not reset", detail: refusal });
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
    try {
      const changed = /** @type {CamerasChangedDocument} */ (
        await request(method, path, { body, headers: this.#commands.leaseHeader(), patience_ms: CAMERA_MS })
      );
      this.#adopt(changed);
      return { changed, refusal: null };
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      if (error.document.status !== 422) await this.#commands.attempt(() => Promise.reject(error));
      void this.#reader.readRig();
      return { changed: null, refusal: error.message };
    }
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

  /** Test both triggers and follow the test until it ends. */
  async testTriggers() {
    const begun = /** @type {JobDocument | null} */ (await this.#commands.send("POST", "/cameras/self_tests"));
    if (!begun) return;
    let job = begun;
    while (!hasEnded(job.state)) {
      this.#store.set({
        running_test: {
          job_id: job.id,
          note: job.progress?.note ?? "",
          done: job.progress?.done ?? 0,
          total: job.progress?.total ?? null,
        },
      });
      await new Promise((resolve) => setTimeout(resolve, LOOK_MS));
      job = (await this.#lookAt(job.id)) ?? job;
    }
    this.#store.set({ running_test: null });
    if (job.problem)
      this.#commands.say({
        tone: "bad",
        title: "The trigger test failed",
        detail: job.problem.detail ?? "",
        remedy: remedyOf(job.problem),
      });
    await Promise.all([this.#reader.readTest(), this.#reader.readRig()]);
  }

  /** @param {string} id */
  async #lookAt(id) {
    try {
      return /** @type {JobDocument} */ (await request("GET", `/jobs/${id}`));
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      if (error.document.status === 404)
        return /** @type {JobDocument} */ ({ id, state: "failed", problem: error.document });
      return null; // the server is away: the banner says so, and the job is read again
    }
  }

  cancelTest() {
    const id = this.#store.state.running_test?.job_id;
    return id ? this.#commands.send("POST", `/jobs/${id}/cancel`) : Promise.resolve(null);
  }

  /** Restart both DACs. */
  async recover() {
    const done = await this.#mirrors("/mirrors/recover");
    if (done)
      this.#commands.say({
        tone: "good",
        title: "The mirrors' DACs were started anew",
        detail: "Both stand where they were told to before.",
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
