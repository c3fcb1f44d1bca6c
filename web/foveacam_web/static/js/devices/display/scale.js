// The scale of a screen: device pixels a millimetre, found by laying something of known size on it. Arithmetic, and what
// this browser keeps for each screen.

const KEY = "foveacam.display.scales";

/** Device pixels a millimetre that are assumed before the scale is set: CSS says 96 pixels an inch. */
export const ASSUMED_PX_PER_MM = 96 / 25.4;

/**
 * What is laid on the screen, mm; `across`: its other side, 0 for a line.
 * @typedef {{name: string, long_mm: number, across_mm: number}} Reference
 * @type {Readonly<Record<"card" | "ruler", Reference>>}
 */
export const REFERENCES = Object.freeze({
  card: { name: "Bank card (85.60 × 53.98 mm)", long_mm: 85.6, across_mm: 53.98 }, // ISO/IEC 7810, ID-1
  ruler: { name: "Ruler (100 mm)", long_mm: 100, across_mm: 0 },
});

/**
 * Name a screen for this browser: by its size, whichever way it is turned.
 * @param {{width: number, height: number}} screen
 */
export function screenKey({ width, height }) {
  return `${Math.max(width, height)}x${Math.min(width, height)}`;
}

/**
 * Return where the pattern stands: its size and its upper left corner, device pixels. The corner is a whole pixel.
 * @param {{width_mm: number, height_mm: number, width_px: number, height_px: number, px_per_mm: number}} of
 */
export function placeOf({ width_mm, height_mm, width_px, height_px, px_per_mm }) {
  const size = { width: width_mm * px_per_mm, height: height_mm * px_per_mm };
  return { ...size, left: Math.round((width_px - size.width) / 2), top: Math.round((height_px - size.height) / 2) };
}

/**
 * Return whether the pattern is larger than the page at this scale.
 * @param {{width_mm: number, height_mm: number, width_px: number, height_px: number, px_per_mm: number}} of
 */
export function isTooLarge({ width_mm, height_mm, width_px, height_px, px_per_mm }) {
  const tolerance_px = 1e-6;
  return width_mm * px_per_mm > width_px + tolerance_px || height_mm * px_per_mm > height_px + tolerance_px;
}

/** The scales that this browser keeps, by screen. */
export class Scales {
  /** @type {Record<string, unknown>} */
  #known = {};

  constructor() {
    try {
      const kept = JSON.parse(localStorage.getItem(KEY) ?? "{}");
      if (kept !== null && typeof kept === "object") this.#known = kept;
    } catch {
      // private mode or a damaged entry: no scale is known
    }
  }

  /** @param {string} key @returns {number | null} device pixels a millimetre */
  of(key) {
    const found = this.#known[key];
    return typeof found === "number" && found > 0 && found <= 1000 ? found : null;
  }

  /** @param {string} key @param {number} px_per_mm */
  put(key, px_per_mm) {
    this.#known = { ...this.#known, [key]: px_per_mm };
    try {
      localStorage.setItem(KEY, JSON.stringify(this.#known));
    } catch {
      // private mode: the scale lasts until the page closes
    }
  }
}
