// Converts between map and drawing coordinates (y is up on the map and down in the drawing), and reads GeoJSON. Pure.

/**
 * @import { Feature, Geojson, Geometry, MapPoint, Outlines } from "#page"
 * @typedef {{x0: number, y0: number, x1: number, y1: number}} Box
 */

const NICE = [1, 2, 5, 10];

/** The transform between metres of the map and units of a drawing. */
export class Sheet {
  /** @param {Box} box the shown part of the map, m @param {{width: number, height: number}} size of the drawing */
  constructor(box, { width, height }) {
    const [across, up] = [Math.max(1e-9, box.x1 - box.x0), Math.max(1e-9, box.y1 - box.y0)];
    this.scale = Math.min(width / across, height / up);
    this.left = (width - across * this.scale) / 2 - box.x0 * this.scale;
    this.top = (height - up * this.scale) / 2 + box.y1 * this.scale;
  }

  /** @param {MapPoint} place */
  toDrawing([x, y]) {
    return { x: this.left + x * this.scale, y: this.top - y * this.scale };
  }

  /** @param {{x: number, y: number}} at @returns {MapPoint} */
  toGround({ x, y }) {
    return [(x - this.left) / this.scale, (this.top - y) / this.scale];
  }

  /** @param {Outlines} outlines */
  path(outlines) {
    return outlines
      .map((outline) => {
        const corners = outline.map((place) => {
          const { x, y } = this.toDrawing(place);
          return `${x.toFixed(2)} ${y.toFixed(2)}`;
        });
        return corners.length > 0 ? `M${corners.join("L")}Z` : "";
      })
      .join("");
  }
}

/** Return all outlines of a GeoJSON surface. @param {Geometry | null | undefined} geometry @returns {Outlines} */
export function outlinesOf(geometry) {
  if (!geometry) return [];
  if (geometry.type === "Polygon") return /** @type {Outlines} */ (geometry.coordinates);
  if (geometry.type === "MultiPolygon") return /** @type {Outlines[]} */ (geometry.coordinates).flat();
  if (geometry.type === "GeometryCollection") return (geometry.geometries ?? []).flatMap(outlinesOf);
  return [];
}

/**
 * Return the features of one kind.
 * @param {Record<string, unknown> | null | undefined} geojson
 * @param {string} kind
 * @returns {Feature[]}
 */
export function featuresOf(geojson, kind) {
  const { features = [] } = /** @type {Partial<Geojson>} */ (geojson ?? {});
  return features.filter(({ properties }) => properties?.["kind"] === kind);
}

/**
 * Return whether a surface contains a point: an odd number of outlines surrounds it.
 * @param {Outlines} outlines
 * @param {MapPoint} place
 */
export function holds(outlines, [x, y]) {
  let inside = false;
  for (const outline of outlines) {
    let [bx, by] = outline[outline.length - 1] ?? [0, 0];
    for (const [ax, ay] of outline) {
      if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) inside = !inside;
      [bx, by] = [ax, ay];
    }
  }
  return inside;
}

/** Return the largest length of 1, 2 or 5 times a power of ten that is not greater than this. @param {number} length */
export function niceLength(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  const best = NICE.filter((each) => each * power <= length * (1 + 1e-9)).pop() ?? 1;
  return Number((best * power).toPrecision(3));
}
