// Sends the calibration commands. A refusal is shown with its remedy, and null returned.

import { file, request } from "../../transport/api.js";
import { hand } from "../../elements/download.js";

/**
 * @import { CalibrationDocument, ComparisonDocument, JobDocument, PanTiltDocument, SessionDocument } from "#api"
 * @import { SettleTimeDocument } from "#api"
 * @import { Commands, DisplayPattern, RunStep, Store } from "#console"
 * @import { CalibrationReader } from "./reader.js"
 * @import { WorkFollower } from "./work.js"
 */

const OPEN_MS = 90_000; // a scene may have to be drawn for the first time
const UNDO_MS = 15_000;
const SLOW_MS = 60_000; // a comparison or a new fit of the lens takes long

/** The calibration commands of one page. */
export class CalibrationOrders {
  #store;
  #commands;
  #reader;
  #work;
  /** @type {Promise<SessionDocument | null> | null} the session that was requested and does not exist yet */
  #coming = null;

  /** @param {{store: Store, commands: Commands, reader: CalibrationReader, work: WorkFollower}} context */
  constructor({ store, commands, reader, work }) {
    this.#store = store;
    this.#commands = commands;
    this.#reader = reader;
    this.#work = work;
  }

  /**
   * Create a session, which holds everything measured for one calibration.
   * @param {string} [label]
   * @returns {Promise<SessionDocument | null>}
   */
  newSession(label = "") {
    const coming = this.#begin(label).finally(() => {
      if (this.#coming === coming) this.#coming = null;
    });
    this.#coming = coming;
    return coming;
  }

  /** @param {string} label */
  #begin(label) {
    return this.#showNew("/calibration_sessions", { label: label || usualLabel() });
  }

  /** Open the simulated rig in another scene. @param {string} scene */
  async openScene(scene) {
    const body = { path: null, scene };
    await this.#commands.send("POST", "/rig/setup/open", { body, patience_ms: OPEN_MS });
    await this.#reader.readPanTilt();
  }

  /** Create a session from the sweeps of several, to be fitted together. @param {string[]} sessions */
  combine(sessions) {
    return this.#showNew("/calibration_sessions/combined", { sessions });
  }

  /** Create a session and show it. @param {string} path @param {object} body */
  async #showNew(path, body) {
    const session = /** @type {SessionDocument | null} */ (await this.#commands.send("POST", path, { body }));
    if (session) await this.#reader.showSession(session);
    return session;
  }

  /** Let all displays show a pattern. @param {DisplayPattern} pattern */
  async showPattern(pattern) {
    await this.#commands.send("PUT", "/displays/pattern", { body: pattern });
    await this.#reader.readDisplays();
  }

  /** @param {string} id */
  async deleteSession(id) {
    await this.#commands.send("DELETE", `/calibration_sessions/${id}`);
    await this.#reader.readSessions();
  }

  /**
   * Run a step in the open session, or in a new one if there is none. Wait for a session that is being created, because
   * the measurement belongs to it and not to the one before.
   * @param {RunStep} step
   * @param {Record<string, unknown>} [options]
   */
  async run(step, options = {}) {
    const session = this.#coming ? await this.#coming : (this.#store.state.session ?? (await this.newSession()));
    if (!session) return;
    const given = Object.fromEntries(
      Object.entries(options).filter(([, value]) => value !== null && value !== undefined),
    );
    const path = `/calibration_sessions/${session.id}/runs`;
    const body = { step, options: given };
    const job = /** @type {JobDocument | null} */ (await this.#commands.send("POST", path, { body }));
    if (job) this.#work.follow(job, { step, session_id: session.id, options: given });
  }

  /** Continue a step that was cancelled or has failed; its measurements are used. @param {import("#page").Work} work */
  async goOn({ step, session_id, options }) {
    if (step === "drift" || step === "acceptance") return;
    if (session_id && session_id !== this.#store.state.session?.id) await this.#reader.openSession(session_id);
    await this.run(step, { ...options, restart: null });
  }

  /** Cancel the running procedure; its measurements are kept. */
  cancel() {
    return this.#work.cancel(this.#commands);
  }

  /** Take a camera's view of the board out of the fit. @param {string} sample_id @param {string} camera */
  async removeSample(sample_id, camera) {
    const id = this.#store.state.session?.id;
    if (!id) return;
    const samples = camera === "wide" ? "wide_samples" : `lenses/${camera}/samples`;
    const path = `/calibration_sessions/${id}/${samples}/${sample_id}`;
    const patience_ms = SLOW_MS;
    const session = /** @type {SessionDocument | null} */ (await this.#commands.send("DELETE", path, { patience_ms }));
    if (session) this.#store.set({ session });
  }

  /** Put the settle time in use that the open session has measured. */
  applySettleTime() {
    const session_id = this.#store.state.session?.id;
    return session_id ? this.#settleTime("PUT", { session_id }) : Promise.resolve();
  }

  /** Put the settle time of the rig file in use. */
  forgetSettleTime() {
    return this.#settleTime("DELETE");
  }

  /** @param {"PUT" | "DELETE"} method @param {object} [body] */
  async #settleTime(method, body) {
    const answer = await this.#commands.send(method, "/settle_time", { body });
    if (!answer) return;
    this.#store.set({ settle_time: /** @type {SettleTimeDocument} */ (answer) });
    await this.#reader.readSettleTime(); // the response to an earlier read may still arrive
  }

  /** @param {string} id */
  async activate(id) {
    if (await this.#commands.send("POST", `/calibrations/${id}/activate`)) await this.#reader.readAll();
  }

  /** Move a record to the trash; it can be undone. @param {string} id @param {string} name */
  async discard(id, name) {
    if (await this.#commands.send("DELETE", `/calibrations/${id}`))
      this.#commands.notify({
        tone: "info",
        title: `“${name}” is in the trash`,
        detail: "",
        stay_ms: UNDO_MS,
        action: { label: "Undo", act: () => this.#restore(id) },
      });
    await this.#reader.readRecords();
  }

  /** @param {string} id */
  async #restore(id) {
    await this.#commands.send("POST", `/calibrations/${id}/restore`);
    await this.#reader.readRecords();
  }

  /** @param {string} a @param {string} b @returns {Promise<ComparisonDocument | null>} */
  compare(a, b) {
    const query = new URLSearchParams({ a, b });
    return this.#commands.attempt(() => request("GET", `/calibrations/compare?${query}`, { patience_ms: SLOW_MS }));
  }

  /**
   * @param {object} document of a calibration file
   * @param {number | null} distance_m distance of its markers, where the file lacks it
   * @returns {Promise<CalibrationDocument | null>}
   */
  async importRecord(document, distance_m) {
    const query = distance_m === null ? "" : `?distance_m=${distance_m}`;
    const options = { body: document, patience_ms: SLOW_MS };
    const record = /** @type {CalibrationDocument | null} */ (
      await this.#commands.send("POST", `/calibrations/import${query}`, options)
    );
    if (record) await this.#reader.readRecords();
    return record;
  }

  /** Save a file of the server; a refusal is shown and not saved. @param {string} path below /api/v1 */
  async save(path) {
    const found = await this.#commands.attempt(() => file(path));
    if (found) hand(found.content, found.name);
  }

  /** Run a drift check. @param {{distance_m: number | null, apply: boolean}} body */
  async checkDrift(body) {
    const job = /** @type {JobDocument | null} */ (await this.#commands.send("POST", "/drift_checks", { body }));
    if (job) this.#work.follow(job, { step: "drift", session_id: null, options: null });
  }

  /** Run the acceptance: the rig measures itself on its markers. */
  async runAcceptance() {
    const job = /** @type {JobDocument | null} */ (await this.#commands.send("POST", "/acceptances", { body: {} }));
    if (job) this.#work.follow(job, { step: "acceptance", session_id: null, options: null });
  }

  /** @param {{station: string} | {pan_deg: number, tilt_deg: number}} body */
  turn(body) {
    return this.#panTilt("/pan_tilt/moves", body);
  }

  /** Stop the pan-tilt at once. */
  hold() {
    return this.#panTilt("/pan_tilt/holds");
  }

  home() {
    return this.#panTilt("/pan_tilt/homings");
  }

  confirmZero() {
    return this.#panTilt("/pan_tilt/zero_confirmations");
  }

  /** @param {string} path @param {object} [body] */
  async #panTilt(path, body) {
    const pan_tilt = /** @type {PanTiltDocument | null} */ (await this.#commands.send("POST", path, { body }));
    if (pan_tilt) this.#store.set({ pan_tilt });
    await this.#reader.readPanTilt();
  }
}

/** Return a label of the current date and time to the second, so that two sessions of one minute differ. */
function usualLabel() {
  return new Date().toLocaleString(undefined, { dateStyle: "medium", timeStyle: "medium" });
}
