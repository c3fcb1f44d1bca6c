// Steers the mirrors over the steering socket: sends the newest target, keep-alives while a control is held, and keeps the
// state that the server reports. Without keep-alives the server first holds the mirrors, then parks them.

import { RequestError } from "../../transport/api.js";
import { VIEWER_WORDS, offers } from "../../operating/session/words.js";
import { API } from "../../root.js";

/**
 * @import { Direction } from "#api"
 * @import { EyePair, Store, Volts } from "#console"
 * @typedef {{direction: Direction, distance_m: number | null, vertical_shift_deg: number}} Gaze
 * @typedef {{volts?: Partial<EyePair<Volts>>, gaze?: Gaze}} Place where to; without any, only a sign of life
 */

const BEAT_MS = 80; // a third of what the server waits
const RETRY_MS = 1000;

/** The steering of one page. */
export class Steering {
  #store;
  /** @type {WebSocket | null} */
  #socket = null;
  #held = false;
  /** @type {ReturnType<typeof setInterval> | undefined} */
  #beat;
  /** The newest order given before the socket was open. @type {object | null} */
  #waiting = null;

  /** @param {{store: Store}} context */
  constructor({ store }) {
    this.#store = store;
    store.on(["rig_page", "sign_in", "signed_out"], ({ rig_page }) => rig_page && this.#open());
    store.on(["lease_token"], () => this.#begin());
    document.addEventListener("visibilitychange", () => document.hidden && this.release());
  }

  /**
   * Hold the mirrors and steer; called at every move.
   * @param {Place} place
   * @param {{alone?: boolean}} [options] `alone`: every call is the only sign of life, as none may come by itself
   */
  hold(place, { alone = false } = {}) {
    if (!this.#held) this.#press();
    if (!alone) this.#beat ??= setInterval(() => this.#send({ held: true }), BEAT_MS);
    this.#send({ held: true, ...place });
  }

  /** Let go: the mirrors go to the last target and stay there. */
  release() {
    if (!this.#held) return;
    this.#held = false;
    this.#stopBeat();
    this.#send({ held: false });
  }

  /** Go to a place once. @param {Place} place */
  go(place) {
    this.#store.set({ steer_refusal: this.#allowed ? "" : VIEWER_WORDS });
    this.#send({ held: false, ...place });
  }

  /** Say nothing more: the server holds the mirrors, and parks them. */
  abandon() {
    this.#held = false;
    this.#stopBeat();
  }

  /** Point both eyes at a direction, at the distance and with the shift that are set. @param {Direction} direction */
  look(direction) {
    if (this.#store.state.steer_split) this.#store.set({ steer_split: false });
    this.hold({ gaze: this.gazeAt(direction) });
  }

  /** @param {Direction} direction @returns {Gaze} */
  gazeAt(direction) {
    const { steer_distance_m, steer_shift_deg } = this.#store.state;
    return { direction, distance_m: steer_distance_m, vertical_shift_deg: steer_shift_deg };
  }

  /** Begin a press: what has ended before must have been let go first. */
  #press() {
    this.#store.set({ steer_refusal: this.#allowed ? "" : VIEWER_WORDS });
    if (this.#socket?.readyState === WebSocket.OPEN) this.#send({ held: false });
    this.#held = true;
  }

  #stopBeat() {
    clearInterval(this.#beat);
    this.#beat = undefined;
  }

  /** @param {{held: boolean} & Place} message */
  #send(message) {
    const order = { type: "steer", ...message };
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify(order));
    else if (this.#allowed) {
      const replaces = "volts" in message || "gaze" in message;
      this.#waiting = replaces ? order : { ...this.#waiting, ...order };
      this.#open();
    }
  }

  /** Whether the server would let this browser steer. */
  get #allowed() {
    const { sign_in, signed_out } = this.#store.state;
    return !signed_out && offers(sign_in, "operate");
  }

  #open() {
    if (this.#socket || !this.#allowed) return;
    const url = new URL(`${API}/mirrors/steering`, location.href);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(url);
    this.#socket = socket;
    socket.onopen = () => {
      this.#begin();
      if (this.#waiting) socket.send(JSON.stringify(this.#waiting));
      this.#waiting = null;
    };
    socket.onmessage = ({ data }) => this.#onMessage(JSON.parse(data));
    socket.onclose = () => this.#closed();
  }

  #begin() {
    if (this.#socket?.readyState !== WebSocket.OPEN) return;
    const { lease, lease_token } = this.#store.state;
    const name = (lease_token && lease?.holder) || "operator";
    this.#socket.send(JSON.stringify({ type: "begin", name, lease: lease_token }));
  }

  /** @param {any} message any: distinguished by its type */
  #onMessage({ type, ...news }) {
    if (type === "hello") this.#store.set({ steer_limits: news });
    else if (type === "problem") this.#store.set({ steer_refusal: new RequestError(news).message });
    else if (type === "state") {
      if (news.status === "ended") this.#stopBeat();
      this.#store.set({ steering: news });
    }
  }

  #closed() {
    this.#socket = this.#waiting = null;
    const lost = this.#held;
    this.abandon();
    const reason = "the connection to the server is lost: the mirrors hold, and are parked soon";
    const { steering } = this.#store.state;
    this.#store.set({ steering: lost && steering ? { ...steering, status: "ended", reason } : null });
    setTimeout(() => this.#store.state.rig_page && this.#open(), RETRY_MS);
  }
}
