// The commands about followed targets: follow one more, change how, let go.

import { timedName } from "../../elements/format.js";

/**
 * @import { FollowedDocument, FollowPatch, FollowRequest } from "#api"
 * @import { Commands, Point, Store } from "#console"
 */

/** The commands about followed targets of one page. */
export class FollowOrders {
  #store;
  #commands;
  /** Called when a target is followed by an order of this page. */
  started = () => {};

  /** @param {{store: Store, commands: Commands}} context */
  constructor({ store, commands }) {
    this.#store = store;
    this.#commands = commands;
  }

  /** Follow one more target. @param {FollowRequest} body */
  async follow(body) {
    const answer = /** @type {FollowedDocument | null} */ (
      await this.#commands.send("POST", "/follows", { body: { ...body, ...this.#picture(body) } })
    );
    if (!answer) return;
    const at = this.#placeOf(body);
    if (at) this.#store.set({ follow_asked: { ...this.#store.state.follow_asked, [answer.id]: at } });
    this.#put(answer);
    this.started();
  }

  /** Return where the wide view shows what is to be followed. @param {FollowRequest} body @returns {Point | null} */
  #placeOf({ pixel, rectangle, target_id }) {
    if (pixel) return { x: pixel.x_px, y: pixel.y_px };
    if (rectangle) return { x: rectangle.x_px + rectangle.width_px / 2, y: rectangle.y_px + rectangle.height_px / 2 };
    const target = this.#store.state.targets?.find(({ id }) => id === target_id);
    return target && target.x_px !== null && target.y_px !== null ? { x: target.x_px, y: target.y_px } : null;
  }

  /**
   * Return the number of the wide picture that was clicked.
   * @param {FollowRequest} body
   * @returns {Pick<FollowRequest, "frame_seq">}
   */
  #picture({ pixel, rectangle }) {
    const { overlay } = this.#store.state;
    return overlay && (pixel || rectangle) ? { frame_seq: overlay.seq } : {};
  }

  /**
   * Change how a target is followed; return null when that was refused.
   * @param {string} id
   * @param {FollowPatch} body
   */
  async change(id, body) {
    const answer = /** @type {FollowedDocument | null} */ (
      await this.#commands.send("PATCH", `/follows/${id}`, { body })
    );
    if (answer) this.#put(answer);
    return answer;
  }

  /** @param {string} id */
  async letGo(id) {
    if (await this.#commands.send("DELETE", `/follows/${id}`)) this.#keep((each) => each.id !== id);
  }

  /** Capture one look at each target as a dataset; its completion is reported by an event. */
  async captureAll() {
    await this.#commands.send("POST", "/follows/rounds", { body: { name: timedName("round") } });
  }

  async letAllGo() {
    if (await this.#commands.send("DELETE", "/follows")) this.#keep(() => false);
  }

  /** Switch whether a click follows. */
  toggle() {
    this.#store.set({ click_follows: !this.#store.state.click_follows });
  }

  /** Let a click fixate again; return whether it followed before. */
  end() {
    const { click_follows } = this.#store.state;
    if (click_follows) this.#store.set({ click_follows: false });
    return click_follows;
  }

  /** @param {FollowedDocument} document */
  #put(document) {
    const followed = this.#store.state.followed ?? [];
    const known = followed.some(({ id }) => id === document.id);
    this.#store.set({
      followed: known ? followed.map((each) => (each.id === document.id ? document : each)) : [...followed, document],
    });
  }

  /** @param {(each: FollowedDocument) => boolean} stays */
  #keep(stays) {
    this.#store.set({ followed: (this.#store.state.followed ?? []).filter(stays) });
  }
}
