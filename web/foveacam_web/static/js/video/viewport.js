// The placement of a picture in its pane: fit, zoom and pan, and the transform between CSS and sensor pixels. No DOM.
// Inside, positions are measured from the picture's top left corner; a sensor pixel (x, y) has its centre half a pixel
// further in, so that (0, 0) is the centre of the first one.

/** @import { PictureScale, Point } from "#page" */

const FINEST = 48; // CSS pixels for one sensor pixel, at most

const FEWER = 1.1; // device pixels for one of the picture: so few more than one are not seen

/**
 * Return the scale of the smallest picture that looks as sharp as the full one: sensor pixels for one of its pixels.
 * @param {number} device_width of the picture on the screen, device px
 * @param {number} width of the full picture, sensor px
 * @returns {PictureScale}
 */
export function sufficientScale(device_width, width) {
  if (device_width <= (width / 4) * FEWER) return 4;
  return device_width <= (width / 2) * FEWER ? 2 : 1;
}

/** The placement of one picture in one box. */
export class Viewport {
  #box = { width: 1, height: 1, left: 0, top: 0 };
  #device_px = 1;
  #zoom = 1;
  /** The position on the picture, from its corner, that is in the middle of the box. */
  #middle;

  /** @param {number} width of the picture, sensor px @param {number} height of the picture, sensor px */
  constructor(width, height) {
    this.width = width;
    this.height = height;
    this.#middle = { x: width / 2, y: height / 2 };
  }

  get zoom() {
    return this.#zoom;
  }

  /** The size of the box, CSS px. */
  get size() {
    return { width: this.#box.width, height: this.#box.height };
  }

  /** CSS pixels for one sensor pixel. */
  get scale() {
    return this.#zoom * Math.min(this.#box.width / this.width, this.#box.height / this.height);
  }

  /**
   * Position of the picture's top left corner in the box, CSS px. It lies on a device pixel, because browsers draw a
   * layer there in any case, and clicks must agree with the drawing.
   */
  get origin() {
    const { width, height, left, top } = this.#box;
    const scale = this.scale;
    return {
      x: this.#snapped(left + width / 2 - this.#middle.x * scale) - left,
      y: this.#snapped(top + height / 2 - this.#middle.y * scale) - top,
    };
  }

  /**
   * @param {{width: number, height: number, left: number, top: number}} box on the page, CSS px
   * @param {number} device_px the size of a device pixel, CSS px
   */
  resize({ width, height, left, top }, device_px) {
    if (width > 0 && height > 0) this.#box = { width, height, left, top };
    this.#device_px = device_px;
    this.#keepInside();
  }

  /** Return the sensor pixel at a position in the box. @param {Point} css @returns {Point} */
  toSensor(css) {
    const { x, y } = this.origin;
    return { x: (css.x - x) / this.scale - 0.5, y: (css.y - y) / this.scale - 0.5 };
  }

  /** Return the position of a sensor pixel in the box. @param {Point} pixel @returns {Point} */
  toCss(pixel) {
    const { x, y } = this.origin;
    return { x: x + (pixel.x + 0.5) * this.scale, y: y + (pixel.y + 0.5) * this.scale };
  }

  /** Return whether the picture contains a sensor pixel. @param {Point} pixel */
  holds(pixel) {
    return pixel.x >= -0.5 && pixel.y >= -0.5 && pixel.x <= this.width - 0.5 && pixel.y <= this.height - 0.5;
  }

  /**
   * Zoom by a factor and keep the picture's point at this position of the box.
   * @param {Point} css
   * @param {number} factor
   */
  zoomAt(css, factor) {
    const before = this.toSensor(css);
    const fit = this.scale / this.#zoom;
    this.#zoom = Math.min(Math.max(1, FINEST / fit), Math.max(1, this.#zoom * factor));
    const after = this.toSensor(css);
    this.#middle = { x: this.#middle.x + before.x - after.x, y: this.#middle.y + before.y - after.y };
    this.#keepInside();
  }

  /** Move the picture by this many CSS pixels. @param {number} dx @param {number} dy */
  pan(dx, dy) {
    this.#middle = { x: this.#middle.x - dx / this.scale, y: this.#middle.y - dy / this.scale };
    this.#keepInside();
  }

  /**
   * Pan only as far as needed to bring a sensor pixel inside the box's margin.
   * @param {Point} pixel
   * @param {number} [margin] CSS px
   */
  reveal(pixel, margin = 40) {
    const { x, y } = this.toCss(pixel);
    const shift = (/** @type {number} */ at, /** @type {number} */ size) =>
      at < margin ? margin - at : at > size - margin ? size - margin - at : 0;
    this.pan(shift(x, this.#box.width), shift(y, this.#box.height));
  }

  reset() {
    this.#zoom = 1;
    this.#middle = { x: this.width / 2, y: this.height / 2 };
  }

  /** @param {number} css */
  #snapped(css) {
    return Math.round(css / this.#device_px) * this.#device_px;
  }

  #keepInside() {
    const scale = this.scale;
    const hold = (/** @type {number} */ at, /** @type {number} */ picture, /** @type {number} */ box) => {
      const half = box / scale / 2;
      return half * 2 >= picture ? picture / 2 : Math.min(picture - half, Math.max(half, at));
    };
    this.#middle = {
      x: hold(this.#middle.x, this.width, this.#box.width),
      y: hold(this.#middle.y, this.height, this.#box.height),
    };
  }
}
