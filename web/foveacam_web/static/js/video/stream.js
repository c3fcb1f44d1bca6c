// Keeps the view socket open, decodes and draws every view's newest frame, and acknowledges each after drawing.
// Runs in the worker where there is OffscreenCanvas, else on the page; it depends on neither.

import { jpegOf, readHeader } from "./protocol.js";

/**
 * @import { Overlay, Point, ShownView, StreamReport, Subscription, ViewInfo, ViewName } from "#page"
 * @import { FrameHeader } from "./protocol.js"
 * @typedef {OffscreenCanvas | HTMLCanvasElement} Canvas
 * @typedef {{
 *   canvas: Canvas, context: Context | null, times_ms: number[], count: number, header: FrameHeader | null,
 *   received_ms: number, subscribed_ms: number, latest: ArrayBuffer | null, busy: boolean
 * }} Slot
 * @typedef {OffscreenCanvasRenderingContext2D | CanvasRenderingContext2D} Context
 */

const FIRST_RETRY_MS = 250;
const LAST_RETRY_MS = 2000;
// the server reports its rates once a second, so five seconds without a message mean a dead connection
const SILENCE_MS = 5000;
const REPORT_MS = 250;
const RATE_WINDOW_MS = 2000;

/** One socket for all views. */
export class ViewStream {
  #url;
  #post;
  /** @type {WebSocket | null} */
  #socket = null;
  #retry_ms = FIRST_RETRY_MS;
  #halted = false;
  #message_ms = 0;
  /** @type {Subscription} */
  #subscription = {};
  /** @type {ViewInfo[]} */
  #views = [];
  /** @type {Map<ViewName, Slot>} */
  #slots = new Map();
  /** @type {Overlay | null} */
  #overlay = null;
  /** @type {{canvas: Canvas, at: Point | null, zoom: number} | null} */
  #loupe = null;

  /** @param {string} url @param {(report: StreamReport) => void} post receives every report to the page */
  constructor(url, post) {
    this.#url = url;
    this.#post = post;
    this.#open();
    setInterval(() => this.#report(), REPORT_MS);
  }

  /** Give a view the canvas that it is drawn on. @param {ViewName} view @param {Canvas} canvas */
  addCanvas(view, canvas) {
    this.#slots.set(view, {
      canvas,
      context: contextOf(canvas),
      times_ms: [],
      count: 0,
      header: null,
      received_ms: 0,
      subscribed_ms: performance.now(),
      latest: null,
      busy: false,
    });
  }

  /** @param {Canvas} canvas */
  setLoupeCanvas(canvas) {
    this.#loupe = { canvas, at: null, zoom: 8 };
  }

  /** Magnify the surroundings of a sensor pixel of the wide view. @param {Point | null} at @param {number} zoom */
  aimLoupe(at, zoom) {
    if (!this.#loupe) return;
    this.#loupe.at = at;
    this.#loupe.zoom = zoom;
    this.#drawLoupe();
  }

  /** @param {Subscription} views replaces the previous subscription */
  subscribe(views) {
    for (const view of /** @type {ViewName[]} */ (Object.keys(views))) {
      const slot = this.#slots.get(view);
      if (slot && !(view in this.#subscription)) slot.subscribed_ms = performance.now();
    }
    this.#subscription = views;
    this.#send({ type: "subscribe", views });
  }

  /** Close the socket and open none while `halted`: the server refuses this browser. @param {boolean} halted */
  halt(halted) {
    this.#halted = halted;
    if (halted) this.#socket?.close();
    else this.#open();
  }

  #open() {
    if (this.#halted || this.#socket) return;
    const socket = new WebSocket(this.#url);
    socket.binaryType = "arraybuffer";
    this.#socket = socket;
    this.#message_ms = performance.now();
    socket.onmessage = (event) => {
      this.#message_ms = performance.now();
      if (typeof event.data === "string") this.#onMessage(event.data);
      else this.#receive(event.data);
    };
    socket.onclose = () => {
      if (this.#socket !== socket) return;
      this.#socket = null;
      this.#post({ type: "down", retry_in_ms: this.#retry_ms });
      setTimeout(() => this.#open(), this.#retry_ms);
      this.#retry_ms = Math.min(LAST_RETRY_MS, this.#retry_ms * 2);
    };
  }

  /** @param {string} text */
  #onMessage(text) {
    const message = JSON.parse(text);
    if (message.type === "hello") {
      this.#views = message.views;
      this.#retry_ms = FIRST_RETRY_MS;
      this.#send({ type: "subscribe", views: this.#subscription });
      this.#post({ type: "hello", hello: message });
    } else if (message.type === "overlay") {
      this.#overlay = message;
      if (!("wide" in this.#subscription)) this.#postOverlay();
    } else if (message.type === "stats") {
      this.#post({ type: "stats", stats: message });
    }
  }

  /** @param {ArrayBuffer} message */
  #receive(message) {
    const header = readHeader(message);
    const name = this.#views.find((view) => view.index === header.view)?.name;
    const slot = name && this.#slots.get(name);
    if (!name || !slot) {
      this.#acknowledge(header);
      return;
    }
    slot.latest = message; // a frame that comes while another is decoded replaces the one that waits
    if (!slot.busy) void this.#show(name, slot);
  }

  /** @param {ViewName} name @param {Slot} slot */
  async #show(name, slot) {
    slot.busy = true;
    while (slot.latest) {
      const message = slot.latest;
      slot.latest = null;
      const received_ms = performance.now();
      const header = readHeader(message);
      try {
        draw(slot, await createImageBitmap(jpegOf(message)));
        this.#note(name, slot, header, received_ms);
      } catch (error) {
        console.warn(`a frame of ${name} could not be decoded`, error);
      }
      this.#acknowledge(header);
    }
    slot.busy = false;
  }

  /** @param {ViewName} name @param {Slot} slot @param {FrameHeader} header @param {number} received_ms */
  #note(name, slot, header, received_ms) {
    slot.count += 1;
    slot.header = header;
    slot.received_ms = received_ms;
    slot.times_ms.push(performance.now());
    if (slot.count === 1) this.#report(); // the page waits for the first picture
    if (name !== "wide") return;
    if (this.#overlay) this.#postOverlay();
    this.#drawLoupe();
  }

  #postOverlay() {
    if (!this.#overlay) return;
    this.#post({ type: "overlay", overlay: this.#overlay });
    this.#overlay = null;
  }

  /** @param {FrameHeader} header */
  #acknowledge(header) {
    this.#send({ type: "ack", view: header.view, seq: header.seq });
  }

  /** @param {object} message */
  #send(message) {
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify(message));
  }

  #drawLoupe() {
    const wide = this.#slots.get("wide");
    if (!this.#loupe?.at || !wide?.header) return;
    const { canvas, at, zoom } = this.#loupe;
    const context = contextOf(canvas);
    if (!context) return;
    const scale = wide.header.scale;
    const size = canvas.width / zoom / scale;
    context.imageSmoothingEnabled = false;
    context.fillRect(0, 0, canvas.width, canvas.height);
    const left = (at.x + 0.5) / scale - size / 2;
    const top = (at.y + 0.5) / scale - size / 2;
    context.drawImage(wide.canvas, left, top, size, size, 0, 0, canvas.width, canvas.height);
  }

  #report() {
    const now_ms = performance.now();
    if (this.#socket && now_ms - this.#message_ms > SILENCE_MS) this.#socket.close();
    if (this.#socket && now_ms - this.#message_ms > SILENCE_MS + 1000) this.#socket.onclose?.(new CloseEvent("close"));
    /** @type {Partial<Record<ViewName, ShownView>>} */
    const views = {};
    for (const [name, slot] of this.#slots) {
      if (name in this.#subscription) views[name] = shown(slot, now_ms);
    }
    this.#post({ type: "shown", views });
  }
}

/** @param {Canvas} canvas @returns {Context | null} */
function contextOf(canvas) {
  return /** @type {Context | null} */ (canvas.getContext("2d", { alpha: false }));
}

/** @param {Slot} slot @param {ImageBitmap} picture */
function draw(slot, picture) {
  const { canvas, context } = slot;
  if (canvas.width !== picture.width || canvas.height !== picture.height) {
    canvas.width = picture.width;
    canvas.height = picture.height;
  }
  context?.drawImage(picture, 0, 0);
  picture.close();
}

/** @param {Slot} slot @param {number} now_ms @returns {ShownView} */
function shown(slot, now_ms) {
  slot.times_ms = slot.times_ms.filter((time_ms) => now_ms - time_ms < RATE_WINDOW_MS);
  const header = slot.header;
  const since_ms = now_ms - (header ? Math.max(slot.received_ms, slot.subscribed_ms) : slot.subscribed_ms);
  return {
    count: slot.count,
    fps: (slot.times_ms.length * 1000) / RATE_WINDOW_MS,
    age_ms: header ? header.age_us / 1000 + (now_ms - slot.received_ms) : 0,
    seq: header?.seq ?? 0,
    width: slot.canvas.width,
    height: slot.canvas.height,
    scale: header?.scale ?? 1,
    binning: header?.binning ?? 1,
    frozen: header?.frozen ?? false,
    silent_ms: since_ms,
    watched_ms: now_ms - slot.subscribed_ms,
  };
}
