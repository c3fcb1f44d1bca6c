// Connects the page to the view stream: in a worker where canvases can be transferred to one, else on the page.

import { socketUrl } from "./protocol.js";
import { ViewStream } from "./stream.js";

/**
 * @import { Point, StreamOrder, StreamReport, Subscription, ViewName } from "#page"
 * @typedef {{
 *   addCanvas(view: ViewName, canvas: HTMLCanvasElement): void, setLoupeCanvas(canvas: HTMLCanvasElement): void,
 *   aimLoupe(at: Point | null, zoom: number): void, subscribe(views: Subscription): void,
 *   halt(halted: boolean): void
 * }} StreamLink
 */

/** Open the view stream. @param {(report: StreamReport) => void} onReport @returns {StreamLink} */
export function openStream(onReport) {
  const url = socketUrl(location.href);
  const offscreen =
    typeof OffscreenCanvas === "function" && "transferControlToOffscreen" in HTMLCanvasElement.prototype;
  return offscreen ? new WorkerLink(url, onReport) : new ViewStream(url, onReport);
}

/** Forwards every call to the worker. */
class WorkerLink {
  #worker = new Worker(new URL("./stream-worker.js", import.meta.url), { type: "module", name: "views" });

  /** @param {string} url @param {(report: StreamReport) => void} onReport */
  constructor(url, onReport) {
    this.#worker.onmessage = ({ data }) => onReport(data);
    this.#order({ type: "start", url });
  }

  /** @param {ViewName} view @param {HTMLCanvasElement} element */
  addCanvas(view, element) {
    const canvas = element.transferControlToOffscreen();
    this.#order({ type: "canvas", view, canvas }, [canvas]);
  }

  /** @param {HTMLCanvasElement} element */
  setLoupeCanvas(element) {
    const canvas = element.transferControlToOffscreen();
    this.#order({ type: "loupe-canvas", canvas }, [canvas]);
  }

  /** @param {Point | null} at @param {number} zoom */
  aimLoupe(at, zoom) {
    this.#order({ type: "loupe", at, zoom });
  }

  /** @param {Subscription} views */
  subscribe(views) {
    this.#order({ type: "subscribe", views });
  }

  /** @param {boolean} halted */
  halt(halted) {
    this.#order({ type: "halt", halted });
  }

  /** @param {StreamOrder} order @param {Transferable[]} [handed] */
  #order(order, handed = []) {
    this.#worker.postMessage(order, handed);
  }
}
