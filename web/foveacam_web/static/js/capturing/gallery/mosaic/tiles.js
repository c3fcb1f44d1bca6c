// Loads and draws the tiles of one mosaic layer: coarser tiles replace those that are loading, and a limited number is
// cached. A pixel of the layer may cover several of the picture (`cell`).

/**
 * @import { MosaicLayer } from "#api"
 * @typedef {{image: CanvasImageSource, width: number, height: number}} Tile
 * @typedef {{left: number, top: number, right: number, bottom: number}} Box
 * @typedef {{level: number, x: number, y: number}} Address
 */

const KEPT = 160; // of 512 px: some 160 MB
const AT_ONCE = 6;
const AGAIN_MS = 3000;

/**
 * The tiles of one layer.
 * @template {Tile} T
 */
export class TileLayer {
  #layer;
  #cell;
  #read;
  #arrived;
  #signal;
  /** @type {Map<string, T>} */
  #kept = new Map();
  /** @type {Map<string, number>} when a tile that failed may be requested again */
  #failed = new Map();
  /** @type {Map<string, Promise<T | null>>} */
  #coming = new Map();
  /** @type {Address[]} */
  #wanted = [];

  /**
   * @param {MosaicLayer} layer
   * @param {{cell: number, read: (content: Blob) => Promise<T>, arrived: () => void, signal: AbortSignal}} how
   *   `cell`: picture px for one of the layer
   */
  constructor(layer, { cell, read, arrived, signal }) {
    this.#layer = layer;
    this.#cell = cell;
    this.#read = read;
    this.#arrived = arrived;
    this.#signal = signal;
  }

  get top() {
    return this.#layer.levels - 1;
  }

  /** Return whether all tiles of the last drawing are loaded. */
  get settled() {
    return this.#coming.size === 0 && this.#wanted.every((address) => this.#kept.has(keyOf(address)));
  }

  /**
   * Draw the layer within a box of picture px.
   * @param {Box} seen
   * @param {number} scale device px for one picture px
   * @param {(image: CanvasImageSource, from: Box, to: Box) => void} draw `from`: px of the image; `to`: picture px
   */
  draw(seen, scale, draw) {
    const level = this.#levelFor(scale);
    this.#wanted = this.#within(seen, level);
    for (const address of this.#wanted) this.#drawOne(address, draw);
    const middle = { x: (seen.left + seen.right) / 2, y: (seen.top + seen.bottom) / 2 };
    this.#wanted.sort((a, b) => this.#apart(a, middle) - this.#apart(b, middle));
    this.#wanted.unshift({ level: Math.min(level, this.#oneTileLevel()), x: 0, y: 0 });
    this.#fetchMore();
  }

  /**
   * Return the finest tile that contains a picture px, and the px in it; load the tile if necessary.
   * @param {number} x
   * @param {number} y
   * @returns {Promise<{tile: T, column: number, row: number} | null>}
   */
  async finestAt(x, y) {
    const { width, height, tile_px } = this.#layer;
    const [column, row] = [Math.floor((x + 0.5) / this.#cell), Math.floor((y + 0.5) / this.#cell)];
    if (column < 0 || row < 0 || column >= width || row >= height) return null;
    const address = { level: this.top, x: Math.floor(column / tile_px), y: Math.floor(row / tile_px) };
    const tile = this.#kept.get(keyOf(address)) ?? (await this.#fetched(address));
    return tile ? { tile, column: column - address.x * tile_px, row: row - address.y * tile_px } : null;
  }

  /** Return the coarsest level whose px are not larger than the screen's. @param {number} scale */
  #levelFor(scale) {
    const finer = Math.log2(scale * this.#cell);
    return Math.min(this.top, Math.max(0, this.top + Math.ceil(finer - 0.25)));
  }

  #oneTileLevel() {
    const { width, height, tile_px } = this.#layer;
    return Math.max(0, this.top - Math.max(0, Math.ceil(Math.log2(Math.max(width, height) / tile_px))));
  }

  /** Return how many picture px one px of a level covers. @param {number} level */
  #unit(level) {
    return this.#cell * 2 ** (this.top - level);
  }

  /** @param {Box} seen @param {number} level @returns {Address[]} */
  #within(seen, level) {
    const side = this.#unit(level) * this.#layer.tile_px;
    const { width, height } = this.#layer;
    const last = (/** @type {number} */ size) => Math.ceil((size * this.#cell) / side) - 1;
    const range = (/** @type {number} */ from, /** @type {number} */ to, /** @type {number} */ most) => {
      const first = Math.max(0, Math.floor(from / side));
      return Array.from(
        { length: Math.max(0, Math.min(most, Math.floor(to / side)) - first + 1) },
        (_, k) => first + k,
      );
    };
    const rows = range(seen.top, seen.bottom, last(height));
    return rows.flatMap((y) => range(seen.left, seen.right, last(width)).map((x) => ({ level, x, y })));
  }

  /**
   * Draw a tile, or the part of a coarser tile that covers it.
   * @param {Address} address
   * @param {(image: CanvasImageSource, from: Box, to: Box) => void} draw
   */
  #drawOne(address, draw) {
    const side = this.#layer.tile_px;
    for (let up = 0; up <= address.level; up += 1) {
      const [part, level] = [2 ** up, address.level - up];
      const above = { level, x: Math.floor(address.x / part), y: Math.floor(address.y / part) };
      const tile = this.#kept.get(keyOf(above));
      if (!tile) continue;
      const [left, top] = [((address.x % part) * side) / part, ((address.y % part) * side) / part];
      const from = {
        left,
        top,
        right: Math.min(tile.width, left + side / part),
        bottom: Math.min(tile.height, top + side / part),
      };
      if (from.right <= from.left || from.bottom <= from.top) return;
      const unit = this.#unit(level);
      const [x, y] = [above.x * side * unit, above.y * side * unit];
      draw(tile.image, from, {
        left: x + from.left * unit,
        top: y + from.top * unit,
        right: x + from.right * unit,
        bottom: y + from.bottom * unit,
      });
      return;
    }
  }

  /** @param {Address} address @param {{x: number, y: number}} middle picture px */
  #apart({ level, x, y }, middle) {
    const side = this.#unit(level) * this.#layer.tile_px;
    return Math.hypot((x + 0.5) * side - middle.x, (y + 0.5) * side - middle.y);
  }

  #fetchMore() {
    for (const address of this.#wanted) {
      if (this.#coming.size >= AT_ONCE || this.#signal.aborted) return;
      const key = keyOf(address);
      if (this.#kept.has(key)) this.#touch(key);
      else if ((this.#failed.get(key) ?? 0) < performance.now()) void this.#fetched(address);
    }
  }

  /** @param {Address} address */
  #fetched(address) {
    const key = keyOf(address);
    const coming = this.#coming.get(key) ?? this.#fetch(address, key);
    this.#coming.set(key, coming);
    return coming;
  }

  /** @param {Address} address @param {string} key @returns {Promise<T | null>} */
  async #fetch(address, key) {
    try {
      const answer = await fetch(urlOf(this.#layer, address), { signal: this.#signal });
      if (!answer.ok) throw new TypeError(`the server answered ${answer.status}`);
      const tile = await this.#read(await answer.blob());
      this.#kept.set(key, tile);
      this.#makeRoom();
      return tile;
    } catch {
      this.#failed.set(key, performance.now() + AGAIN_MS); // it is requested again when it is visible again
      return null;
    } finally {
      this.#coming.delete(key);
      if (!this.#signal.aborted) this.#arrived();
    }
  }

  /** @param {string} key */
  #touch(key) {
    const tile = this.#kept.get(key);
    if (!tile) return;
    this.#kept.delete(key);
    this.#kept.set(key, tile);
  }

  #makeRoom() {
    for (const [key, tile] of this.#kept) {
      if (this.#kept.size <= KEPT) return;
      if (tile.image instanceof ImageBitmap) tile.image.close();
      this.#kept.delete(key);
    }
  }
}

/** @param {Address} address */
function keyOf({ level, x, y }) {
  return `${level}/${x}_${y}`;
}

/** @param {MosaicLayer} layer @param {Address} address */
function urlOf({ tiles_url }, { level, x, y }) {
  return tiles_url.replace("{level}", String(level)).replace("{x}", String(x)).replace("{y}", String(y));
}
