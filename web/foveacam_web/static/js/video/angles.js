// Converts wide pixels to directions and back by the calibrated wide lens. The centre of the first pixel is (0, 0).

/**
 * @import { Direction, SteeringDocument, WideLensDocument } from "#api"
 * @import { Point } from "#page"
 */

const DEG = Math.PI / 180;
const ROUNDS = 12; // the mild distortion of this lens converges to 1e-9 in half as many

/**
 * Distort a direction (tan ax, tan ay) as the lens does.
 * @param {WideLensDocument} lens
 * @param {number} x
 * @param {number} y
 */
function distort(lens, x, y) {
  const [k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0] = lens.distortion;
  const r2 = x * x + y * y;
  const radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {
    x: x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
    y: y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
  };
}

/**
 * Return the wide pixel of a direction.
 * @param {WideLensDocument} lens
 * @param {Direction} direction
 * @returns {Point}
 */
export function pixelOf(lens, direction) {
  const seen = distort(lens, Math.tan(direction.ax_deg * DEG), Math.tan(direction.ay_deg * DEG));
  return { x: lens.fx_px * seen.x + lens.cx_px, y: lens.fy_px * seen.y + lens.cy_px };
}

/**
 * Return the direction of a wide pixel, by fixed-point iteration on the distortion.
 * @param {WideLensDocument} lens
 * @param {Point} pixel
 * @returns {Direction}
 */
export function directionOf(lens, pixel) {
  const seen = { x: (pixel.x - lens.cx_px) / lens.fx_px, y: (pixel.y - lens.cy_px) / lens.fy_px };
  let x = seen.x;
  let y = seen.y;
  for (let round = 0; round < ROUNDS; round++) {
    const there = distort(lens, x, y);
    x += seen.x - there.x;
    y += seen.y - there.y;
  }
  return { ax_deg: Math.atan(x) / DEG, ay_deg: Math.atan(y) / DEG };
}

/**
 * Return whether both eyes can be steered to a direction.
 * @param {SteeringDocument} field
 * @param {Direction} direction
 */
export function inField(field, direction) {
  const { ax_deg, ay_deg } = direction;
  return (
    ax_deg >= field.ax_min_deg && ax_deg <= field.ax_max_deg && ay_deg >= field.ay_min_deg && ay_deg <= field.ay_max_deg
  );
}

/**
 * Return the outline of the steerable field in wide pixels; the lens bends its edges, so each is sampled.
 * @param {WideLensDocument} lens
 * @param {SteeringDocument} field
 * @param {number} [samples] along each edge
 * @returns {Point[]}
 */
export function fieldOutline(lens, field, samples = 12) {
  /** @type {[number, number][]} */
  const corners = [
    [field.ax_min_deg, field.ay_min_deg],
    [field.ax_max_deg, field.ay_min_deg],
    [field.ax_max_deg, field.ay_max_deg],
    [field.ax_min_deg, field.ay_max_deg],
  ];
  return corners.flatMap(([ax, ay], index) => {
    const [next_ax, next_ay] = corners[(index + 1) % 4] ?? [ax, ay];
    return Array.from({ length: samples }, (_, step) => {
      const t = step / samples;
      return pixelOf(lens, { ax_deg: ax + t * (next_ax - ax), ay_deg: ay + t * (next_ay - ay) });
    });
  });
}
