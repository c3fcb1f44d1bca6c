// Draws a mosaic's picture and depth on a canvas, pans and zooms, and reads the depth at the pointer.

import { h } from "../../../elements/dom.js";
import { Viewport } from "../../../video/viewport.js";
import { depthTileOf } from "./depth.js";
import { listenToHands } from "./gestures.js";
import { TileLayer } from "./tiles.js";

/**
 * @import { MadeMosaic, MosaicLayer } from "#api"
 * @import { MosaicMix, Point } from "#page"
 * @import { Box } from "./tiles.js"
 * @typedef {{pixel: Point, ax_deg: number, ay_deg: number, z_m: number | null} | null} Reading `z_m`: null where unknown
 */

const DEGREES = 180 / Math.PI;
const COARSE = 3; // device px for one px of the picture, from which on its px are drawn as squares

/** The viewer of one mosaic. */
export class MosaicViewer {
  #made;
  #canvas = h("canvas", { class: "mosaic-canvas" });
  #viewport;
  #picture;
  #depth;
  #onReading;
  /** @type {MosaicMix} */
  #mix = { shown: "picture", share: 0.6 };
  #drawing = 0;
  #drawn = false;
  #asked = 0;
  /** @type {Point | null} */
  #at = null;

  /**
   * @param {MadeMosaic} made
   * @param {{onReading: (reading: Reading) => void, moved: (scale: number) => void, signal: AbortSignal}} how
   *   `moved`: CSS px for one picture px
   */
  constructor(made, { onReading, moved, signal }) {
    this.#made = made;
    this.#onReading = onReading;
    this.moved = moved;
    this.#viewport = new Viewport(made.width, made.height);
    const arrived = () => this.#redraw();
    this.#picture = new TileLayer(layerOf(made, "picture"), { cell: 1, read: pictureTile, arrived, signal });
    this.#depth = new TileLayer(layerOf(made, "depth"), {
      cell: made.cell_px,
      read: (content) => depthTile(content, made),
      arrived,
      signal,
    });
    this.element = h(
      "div",
      {
        class: "mosaic-view",
        tabindex: "0",
        role: "application",
        "aria-label":
          "Mosaic. Arrow keys move it, plus and minus zoom, 0 shows all of it, 1 its own pixels; the middle is read out.",
      },
      this.#canvas,
    );
    listenToHands(this.element, {
      pan: (dx, dy) => this.#change(() => this.#viewport.pan(dx, dy)),
      zoom: (at, factor) => this.#change(() => this.#viewport.zoomAt(at, factor)),
      fit: () => this.fit(),
      whole: () => this.whole(),
      point: (at) => this.#point(at),
      box: () => this.#box(),
    });
    const sized = new ResizeObserver(() => this.#resize());
    sized.observe(this.element);
    signal.addEventListener("abort", () => sized.disconnect());
  }

  /** Return whether all visible tiles are loaded. */
  get settled() {
    return (
      this.#drawn &&
      this.#drawing === 0 &&
      this.#picture.settled &&
      (this.#mix.shown === "picture" || this.#depth.settled)
    );
  }

  /** @param {MosaicMix} mix */
  show(mix) {
    this.#mix = mix;
    this.#redraw();
  }

  fit() {
    this.#change(() => this.#viewport.reset());
  }

  /** Zoom to one picture px for one px of the screen. */
  whole() {
    this.zoom(1 / (this.#viewport.scale * devicePixelRatio));
  }

  /** @param {number} factor */
  zoom(factor) {
    const { width, height } = this.#box();
    this.#change(() => this.#viewport.zoomAt({ x: width / 2, y: height / 2 }, factor));
  }

  /** @param {() => void} change */
  #change(change) {
    change();
    this.#redraw();
  }

  #box() {
    return this.element.getBoundingClientRect();
  }

  #resize() {
    const { width, height, left, top } = this.#box();
    if (width === 0 || height === 0) return;
    this.#canvas.width = Math.round(width * devicePixelRatio);
    this.#canvas.height = Math.round(height * devicePixelRatio);
    this.#viewport.resize({ width, height, left, top }, 1 / devicePixelRatio);
    this.#redraw();
  }

  #redraw() {
    if (this.#drawing === 0) this.#drawing = requestAnimationFrame(() => this.#draw());
  }

  #draw() {
    this.#drawing = 0;
    const context = this.#canvas.getContext("2d");
    if (!context || this.#canvas.width === 0) return;
    const { shown, share } = this.#mix;
    const [origin, scale] = [this.#viewport.origin, this.#viewport.scale * devicePixelRatio];
    const [left, top] = [origin.x * devicePixelRatio, origin.y * devicePixelRatio];
    const seen = {
      left: -left / scale,
      top: -top / scale,
      right: (this.#canvas.width - left) / scale,
      bottom: (this.#canvas.height - top) / scale,
    };
    const draw = (/** @type {CanvasImageSource} */ image, /** @type {Box} */ from, /** @type {Box} */ to) => {
      // on whole px: no seams between tiles
      const [x, y] = [Math.round(left + to.left * scale), Math.round(top + to.top * scale)];
      const [right, bottom] = [Math.round(left + to.right * scale), Math.round(top + to.bottom * scale)];
      context.drawImage(
        image,
        from.left,
        from.top,
        from.right - from.left,
        from.bottom - from.top,
        x,
        y,
        right - x,
        bottom - y,
      );
    };
    context.reset();
    context.beginPath();
    context.rect(left, top, this.#made.width * scale, this.#made.height * scale);
    context.clip();
    context.fillStyle = getComputedStyle(this.#canvas).color; // where depth alone is shown and is unknown
    context.fill();
    context.imageSmoothingEnabled = scale < COARSE;
    if (shown !== "depth") this.#picture.draw(seen, scale, draw);
    context.globalAlpha = shown === "both" ? share : 1;
    context.imageSmoothingEnabled = scale * this.#made.cell_px < 1;
    if (shown !== "picture") this.#depth.draw(seen, scale, draw);
    this.#drawn = true;
    this.element.classList.toggle("whole", this.#viewport.zoom <= 1);
    this.moved(this.#viewport.scale);
    if (this.#at) void this.#read(this.#at);
  }

  /** @param {Point | null} at CSS px */
  #point(at) {
    this.#at = at;
    if (at) void this.#read(at);
    else this.#onReading(null);
  }

  /** @param {Point} at */
  async #read(at) {
    const asked = ++this.#asked;
    const place = this.#viewport.toSensor(at);
    const pixel = { x: Math.round(place.x), y: Math.round(place.y) };
    if (!this.#viewport.holds(place)) return this.#onReading(null);
    const { f_px, u0_px, v0_px } = this.#made;
    const angles = {
      ax_deg: DEGREES * Math.atan((place.x + u0_px) / f_px),
      ay_deg: DEGREES * Math.atan((place.y + v0_px) / f_px),
    };
    const found = await this.#depth.finestAt(pixel.x, pixel.y);
    if (asked === this.#asked && this.#at !== null)
      this.#onReading({ pixel, ...angles, z_m: found?.tile.depth.at(found.column, found.row) ?? null });
  }
}

/** @param {MadeMosaic} made @param {MosaicLayer["name"]} name */
function layerOf({ layers }, name) {
  const layer = layers.find((each) => each.name === name);
  if (!layer) throw new Error(`the mosaic has no layer ${name}`);
  return layer;
}

/** @param {Blob} content */
async function pictureTile(content) {
  const image = await createImageBitmap(content);
  return { image, width: image.width, height: image.height };
}

/** @param {Blob} content @param {MadeMosaic} made */
async function depthTile(content, { step_m, near_m, far_m }) {
  const depth = await depthTileOf(content, step_m);
  const image = await createImageBitmap(depth.painted({ near_m: near_m ?? 0, far_m: far_m ?? 1 }));
  return { image, depth, width: depth.width, height: depth.height };
}
