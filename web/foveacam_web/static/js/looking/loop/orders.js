// The commands about the vergence loop: its target, its axes, its settings, tuning. Refusals of values are returned, so
// that they are shown beside their controls.

import { JobFollower } from "../../transport/jobs.js";
import { LatestOrder } from "../../transport/latest_order.js";

/**
 * @import { JobDocument, LoopDocument, LoopDrag, LoopPatch, LoopSettingsDocument, LoopSettingsPatch } from "#api"
 * @import { LoopTargetRequest } from "#api"
 * @import { Commands, Point, Store } from "#console"
 * @import { GainGroup, GroupName } from "./settings.js"
 */

const DRAG_PAUSE_MS = 66; // 15 a second at most
/** The settings that tuning finds. @type {GainGroup[]} */
const GAINS = ["pan", "depth", "vertical"];

/** The commands about the vergence loop of one page. */
export class LoopOrders {
  #store;
  #commands;
  /** @type {LatestOrder<LoopDrag>} */
  #drags;
  /** Follows the tuning, begun by this or any other client. */
  tuning = new JobFollower({
    ours: ({ kind }) => kind === "loop_tune",
    news: (job) => this.#store.set({ loop_tuning: job.kind ? job : null }), // null: the server does not know it
  });
  /** Called after a change of settings, which has no event: a read in progress may return the previous ones. */
  changed = () => {};

  /** @param {{store: Store, commands: Commands}} context */
  constructor({ store, commands }) {
    this.#store = store;
    this.#commands = commands;
    this.#drags = new LatestOrder({
      pause_ms: DRAG_PAUSE_MS,
      send: (body) => commands.send("PUT", "/loop/drag", { body }),
    });
  }

  /**
   * Keep both foveae on the point chosen in the wide view, or on the middle of the chosen rectangle.
   * @param {Pick<import("#api").FixationRequest, "pixel" | "rectangle">} chosen
   */
  async lookAt({ pixel, rectangle }) {
    const at = rectangle
      ? { x_px: rectangle.x_px + rectangle.width_px / 2, y_px: rectangle.y_px + rectangle.height_px / 2 }
      : pixel;
    if (!at) return;
    const { overlay } = this.#store.state;
    /** @type {LoopTargetRequest} */
    const body = { pixel: at, ...(overlay && { frame_seq: overlay.seq }) };
    this.#adopt(await this.#commands.send("POST", "/loop", { body }));
  }

  /** Let both eyes look at a place of the wide view. Called at every move of the pointer. @param {Point} pixel */
  drag({ x, y }) {
    this.#drags.give({ x_px: x, y_px: y });
  }

  /** Let the loop go on with its target. */
  async release() {
    await this.#drags.drop();
    await this.#commands.send("DELETE", "/loop/drag");
  }

  /** Let an eye keep a point of its own picture centred. @param {"left" | "right"} eye @param {Point} pixel */
  async partEye(eye, { x, y }) {
    const body = { x_px: Math.max(0, x), y_px: Math.max(0, y) };
    this.#adopt(await this.#commands.send("PUT", `/loop/eyes/${eye}`, { body }));
  }

  /** Let both eyes look at one target again. */
  async uniteEyes() {
    this.#adopt(await this.#commands.send("DELETE", "/loop/eyes"));
  }

  /** Pause the loop, or let it go on. */
  async togglePause() {
    const { loop } = this.#store.state;
    if (!loop?.running) return;
    this.#adopt(await this.#commands.send("PATCH", "/loop", { body: { paused: !loop.paused } }));
  }

  async end() {
    await this.#commands.send("DELETE", "/loop");
  }

  async resetTrigger() {
    this.#adopt(await this.#commands.send("POST", "/loop/trigger/reset"));
  }

  /** Hold axes or set their commands; return the refusal, if any. @param {LoopPatch} body */
  async change(body) {
    const { document, refusal } = await this.#tried("PATCH", "/loop", body);
    this.#adopt(document);
    return refusal;
  }

  /** @param {LoopSettingsPatch} body */
  set(body) {
    return this.#settings("PATCH", "/loop/settings", body);
  }

  /** Put one group of settings, or all, back to their defaults. @param {GroupName | null} group */
  async reset(group) {
    const query = group === null ? "" : `?group=${group}`;
    const { refusal } = await this.#settings("DELETE", `/loop/settings${query}`);
    if (refusal) this.#commands.notify({ tone: "warn", title: "Not reset", detail: refusal });
    return refusal;
  }

  async resetGains() {
    for (const group of GAINS) if (await this.reset(group)) return;
  }

  /** @param {boolean} polish whether the gains of the relays are improved by CMA-ES */
  async tune(polish) {
    this.#store.set({ tune_refusal: "" });
    const { document, refusal } = await this.#tried("POST", "/loop/tune", { polish });
    if (document) this.tuning.follow(/** @type {JobDocument} */ (document));
    else this.#store.set({ tune_refusal: refusal ?? "" });
  }

  abortTuning() {
    return this.tuning.cancel(this.#commands);
  }

  /**
   * @param {"PATCH" | "DELETE"} method
   * @param {string} path
   * @param {object} [body]
   * @returns {Promise<{settings: LoopSettingsDocument | null, refusal: string | null}>}
   */
  async #settings(method, path, body) {
    const { document, refusal } = await this.#tried(method, path, body);
    const settings = /** @type {LoopSettingsDocument | null} */ (document);
    const { loop } = this.#store.state;
    if (settings && loop) this.#store.set({ loop: { ...loop, settings } });
    if (settings) this.changed();
    return { settings, refusal };
  }

  /**
   * Return a document or the reason of its refusal; a refusal that no value can avoid (lease) is also shown as a message.
   * @param {"POST" | "PATCH" | "DELETE"} method
   * @param {string} path
   * @param {object} [body]
   */
  async #tried(method, path, body) {
    const { answer, error } = await this.#commands.tried(method, path, {
      body,
      shows: ({ document }) => ![409, 422].includes(document.status) || Boolean(this.#store.state.lease?.holder),
    });
    return { document: answer, refusal: error?.message ?? null };
  }

  /** @param {unknown} document of the loop; null where the order was refused */
  #adopt(document) {
    if (document) this.#store.set({ loop: /** @type {LoopDocument} */ (document) });
  }
}
