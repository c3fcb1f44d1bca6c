// Draws a plan as one SVG to scale: ground, obstacles, rings, regions, targets, scale bar, legend. It contains no
// styles: css/planner.css holds them, and an export embeds them.

import { s } from "../../elements/dom.js";
import { plainly } from "../../devices/rig/scale.js";
import { featuresOf, niceLength, outlinesOf, Sheet } from "./geometry.js";
import { area } from "./words.js";

/**
 * @import { MapDocument, RegionsDocument, RingDocument } from "#api"
 * @import { MapPoint, Outlines } from "#page"
 * @import { Box } from "./geometry.js"
 * @typedef {{
 *   map: MapDocument, picture: string | null, targets_m: MapPoint[], ring: RingDocument | null, regions: RegionsDocument | null,
 *   stale: boolean, whole: boolean
 * }} Scene `whole`: the drawing includes the whole rings, not only the map
 * @typedef {{width: number, plan: number, height: number, sheet: Sheet}} Layout `plan`: height of the part to scale
 */

/** Number of target colours. */
export const HUES = 8;
const ROW = 18;
const LETTER = 6.1; // average width of a letter in the legend
const EDGE = 12;

/**
 * Lay out a scene in a given width, with a limit for the plan's height.
 * @param {Scene} scene
 * @param {{width: number, tallest: number}} room
 * @returns {Layout}
 */
export function layOut(scene, { width, tallest }) {
  const box = boxOf(scene);
  const ratio = (box.y1 - box.y0) / Math.max(1e-9, box.x1 - box.x0);
  const plan = Math.round(Math.min(Math.max(width * ratio, 0.4 * width), 1.2 * width, tallest));
  const inner = new Sheet(box, { width: width - 2 * EDGE, height: plan - 2 * EDGE });
  inner.left += EDGE;
  inner.top += EDGE;
  const rows = legendRows(scene, width).length;
  return { width, plan, height: plan + ROW * rows + 30, sheet: inner };
}

/** @param {Scene} scene @returns {Box} */
function boxOf({ map, targets_m, ring, whole }) {
  const [x0 = 0, y0 = 0, x1 = 1, y1 = 1] = map.bounds_m;
  const box = { x0, y0, x1, y1 };
  if (!whole || !ring) return box;
  const reach = Math.max(ring.outer_m, ring.inner_m);
  for (const [x, y] of targets_m) {
    [box.x0, box.y0] = [Math.min(box.x0, x - reach), Math.min(box.y0, y - reach)];
    [box.x1, box.y1] = [Math.max(box.x1, x + reach), Math.max(box.y1, y + reach)];
  }
  return box;
}

/** @param {Scene} scene @param {Layout} layout @returns {SVGElement[]} */
export function drawScene(scene, layout) {
  const { sheet, width, plan } = layout;
  const clip = s("clipPath", { id: "plan-frame" }, s("rect", { x: 0, y: 0, width, height: plan }));
  return [
    s("defs", {}, clip),
    s("rect", { class: "paper", x: 0, y: 0, width, height: layout.height }),
    s("g", { "clip-path": "url(#plan-frame)", class: scene.stale ? "stale" : "" }, [
      ...ground(scene, sheet),
      ...surfaces(scene, sheet),
      ...rings(scene, sheet),
    ]),
    s("g", { class: "sights", "clip-path": "url(#plan-frame)" }),
    ...scene.targets_m.map((place, index) => marker(sheet, place, index)),
    ...foot(scene, layout),
  ];
}

/** @param {Scene} scene @param {Sheet} sheet */
function ground({ map, picture }, sheet) {
  const [x0 = 0, y0 = 0, x1 = 1, y1 = 1] = map.bounds_m;
  const corner = sheet.toDrawing([x0, y1]);
  const box = { x: corner.x, y: corner.y, width: (x1 - x0) * sheet.scale, height: (y1 - y0) * sheet.scale };
  const photo = picture && s("image", { ...box, href: picture, preserveAspectRatio: "none", class: "photo" });
  return [s("rect", { class: "ground", ...box }), ...(photo ? [photo] : [])];
}

/** @param {Scene} scene @param {Sheet} sheet */
function surfaces({ map, regions }, sheet) {
  const surface = (/** @type {Outlines} */ outlines, /** @type {string} */ name) =>
    s("path", { class: name, "fill-rule": "evenodd", d: sheet.path(outlines) });
  const own = featuresOf(regions?.geojson, "region").map((feature, index) =>
    surface(outlinesOf(feature.geometry), `region hue-${index % HUES}`),
  );
  const union = featuresOf(regions?.geojson, "union").map((feature) => surface(outlinesOf(feature.geometry), "union"));
  const obstacles = featuresOf(map.map, "obstacle").map((feature) => surface(outlinesOf(feature.geometry), "obstacle"));
  return [...own, ...union, ...obstacles];
}

/** @param {Scene} scene @param {Sheet} sheet */
function rings({ targets_m, ring }, sheet) {
  if (!ring) return [];
  return targets_m.flatMap((place, index) => {
    const { x: cx, y: cy } = sheet.toDrawing(place);
    const circle = (/** @type {number} */ radius_m, /** @type {string} */ name) =>
      s("circle", { class: `bound ${name} hue-${index % HUES}`, cx, cy, r: radius_m * sheet.scale });
    return [circle(ring.inner_m, "near"), circle(ring.outer_m, "far")];
  });
}

/** @param {Sheet} sheet @param {MapPoint} place @param {number} index */
function marker(sheet, place, index) {
  const { x, y } = sheet.toDrawing(place);
  return s(
    "g",
    { class: `target hue-${index % HUES}`, transform: `translate(${x.toFixed(2)} ${y.toFixed(2)})` },
    s("circle", { class: "grip", r: 16 }),
    s("circle", { class: "disc", r: 9 }),
    s("text", { y: 4, text: String(index) }),
  );
}

/**
 * Draw the lines of sight from a point to the targets that are seen from it.
 * @param {Sheet} sheet
 * @param {MapPoint} from
 * @param {{place: MapPoint, target: number}[]} seen
 */
export function sightLines(sheet, from, seen) {
  const { x, y } = sheet.toDrawing(from);
  const lines = seen.map(({ place, target }) => {
    const to = sheet.toDrawing(place);
    return s("line", { class: `sight hue-${target % HUES}`, x1: x, y1: y, x2: to.x, y2: to.y });
  });
  return [...lines, s("circle", { class: "probe", cx: x, cy: y, r: 4 })];
}

/** Draw the scale bar and the legend. @param {Scene} scene @param {Layout} layout */
function foot(scene, { width, plan, sheet }) {
  const length_m = niceLength((0.3 * width) / sheet.scale);
  const length = length_m * sheet.scale;
  const y = plan + 14;
  const bar = s(
    "g",
    { class: "scale-bar" },
    s("path", { d: `M${EDGE} ${y - 5}v5h${length.toFixed(2)}v-5` }),
    s("text", { x: EDGE + length + 8, y, text: `${plainly(length_m)} m` }),
  );
  const rows = legendRows(scene, width).flatMap((row, line) =>
    row.map(({ x, name, text }) => {
      const top = plan + 34 + line * ROW;
      return s("g", { class: "entry" }, sample(name, x, top), s("text", { x: x + (name ? 22 : 0), y: top, text }));
    }),
  );
  return [bar, ...rows];
}

/** @param {string} name @param {number} x @param {number} y */
function sample(name, x, y) {
  if (!name) return null;
  if (name.startsWith("bound") || name === "union")
    return s("line", { class: name, x1: x, y1: y - 4, x2: x + 16, y2: y - 4 });
  if (name.startsWith("target"))
    return s("g", { class: name }, s("circle", { class: "disc", cx: x + 8, cy: y - 4, r: 5 }));
  return s("rect", { class: name, x, y: y - 10, width: 16, height: 11 });
}

/** Arrange the legend's entries in rows. @param {Scene} scene @param {number} width */
function legendRows({ map, ring, regions, targets_m }, width) {
  const entries = [{ name: "target hue-0", text: "target" }];
  if (regions && !regions.empty_because) {
    entries.push(
      { name: "region hue-0", text: "its region, in its colour" },
      { name: "union", text: "union of the regions" },
    );
  }
  if (ring && targets_m.length > 0) {
    entries.push(
      { name: "bound near", text: `nearest, ${plainly(ring.inner_m)} m` },
      { name: "bound far", text: `D_max, ${plainly(ring.outer_m)} m` },
    );
  }
  if (map.obstacles > 0) entries.push({ name: "obstacle", text: "obstacle" });
  if (regions) entries.push({ name: "", text: areasText(regions) });
  /** @type {{x: number, name: string, text: string}[][]} */
  const rows = [];
  let x = Infinity;
  for (const { name, text } of entries) {
    const long = (name ? 22 : 0) + LETTER * text.length + 14;
    if (x + long > width) rows.push([]);
    if (x + long > width) x = EDGE;
    rows[rows.length - 1]?.push({ x, name, text });
    x += long;
  }
  return rows;
}

/** @param {RegionsDocument} regions */
function areasText({ areas, regions }) {
  return regions.length === 1
    ? `area ${area(areas.multi_m2)}`
    : `multi ${area(areas.multi_m2)}, single ${area(areas.single_m2)}`;
}
