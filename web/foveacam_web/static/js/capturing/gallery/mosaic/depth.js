// Decodes the server's depth tiles, which hold metres in the colours of a PNG, and colours depth for display.

// The colour map Turbo at 33 points, far to near, as in the server's depth pictures; linear between them within 1 %.
const TURBO =
  "30123b 392a73 4040a2 4456c7 466be3 4680f6 4294ff 37a8fa 28bceb 1ccdd8 18ddc2 1fe9af 32f298 4ef97d 6dfe62 8bff4b a4fc3c b7f735 cbed34 dde037 ecd13a f7c13a fdae35 fe992c fb8122 f56918 ec530f e14109 d23105 c12302 ac1701 950d01 7a0403".split(
    " ",
  );
const SHADES = 256;

/** @typedef {{near_m: number, far_m: number}} Span */

/** Red, green and blue of 256 shades, 0 far to 255 near. */
const COLOURS = Uint8ClampedArray.from({ length: SHADES * 3 }, (_, index) => {
  const at = (Math.floor(index / 3) / (SHADES - 1)) * (TURBO.length - 1);
  const low = Math.min(TURBO.length - 2, Math.floor(at));
  const part = (/** @type {number} */ knot) =>
    Number.parseInt((TURBO[knot] ?? "").slice(2 * (index % 3), 2 * (index % 3) + 2), 16);
  return part(low) + (at - low) * (part(low + 1) - part(low));
});

/** A tile of depth. */
export class DepthTile {
  #pixels;
  #step_m;

  /** @param {ImageData} data @param {number} step_m */
  constructor(data, step_m) {
    this.width = data.width;
    this.height = data.height;
    this.#pixels = data.data;
    this.#step_m = step_m;
  }

  /** Return the depth along z in metres at a cell; null where unknown. @param {number} column @param {number} row */
  at(column, row) {
    if (column < 0 || row < 0 || column >= this.width || row >= this.height) return null;
    return this.#metres(4 * (row * this.width + column));
  }

  /** Return the tile in colours, transparent where depth is unknown. @param {Span} span @returns {ImageData} */
  painted({ near_m, far_m }) {
    const out = new ImageData(this.width, this.height);
    for (let at = 0; at < out.data.length; at += 4) {
      const z_m = this.#metres(at);
      if (z_m === null) continue;
      const share = Math.min(1, Math.max(0, (far_m - z_m) / (far_m - near_m)));
      const shade = 3 * Math.round(share * (SHADES - 1));
      out.data.set(COLOURS.subarray(shade, shade + 3), at);
      out.data[at + 3] = 255;
    }
    return out;
  }

  /** @param {number} at */
  #metres(at) {
    const [red = 0, green = 0, blue = 0] = this.#pixels.subarray(at, at + 3);
    const steps = red * 65_536 + green * 256 + blue;
    return steps === 0 ? null : steps * this.#step_m;
  }
}

/** Decode the file of a depth tile. @param {Blob} content @param {number} step_m */
export async function depthTileOf(content, step_m) {
  // the colours are numbers: the browser must not convert them
  const image = await createImageBitmap(content, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  const canvas = new OffscreenCanvas(image.width, image.height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (!context) throw new Error("this browser draws nothing beside the page");
  context.drawImage(image, 0, 0);
  image.close();
  return new DepthTile(context.getImageData(0, 0, canvas.width, canvas.height), step_m);
}

/** Return the colour scale as a CSS gradient, near first. */
export function gradient() {
  return `linear-gradient(to right, ${[...TURBO]
    .reverse()
    .map((colour) => `#${colour}`)
    .join(", ")})`;
}

/** Return about four round depths within a span. @param {Span} span */
export function ticksOf({ near_m, far_m }) {
  const rough = (far_m - near_m) / 4;
  const decade = 10 ** Math.floor(Math.log10(rough));
  const step = decade * ([1, 2, 2.5, 5].find((part) => part * decade >= rough) ?? 10);
  const first = Math.ceil(near_m / step);
  return Array.from({ length: Math.max(0, Math.floor(far_m / step) - first + 1) }, (_, k) => (first + k) * step);
}
