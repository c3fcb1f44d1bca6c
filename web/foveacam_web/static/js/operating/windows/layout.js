// How a window is divided into panes: a tree of splits whose leaves are sources, its address, and where each pane stands.
// Pure functions; a source is shown once in a window.

import { ROOT } from "../../root.js";

/**
 * @import { Axis, Box, Divider, Layout, Source } from "#page"
 */

/** @type {readonly Source[]} */
export const SOURCES = Object.freeze(
  /** @type {Source[]} */ ([
    "wide",
    "left",
    "right",
    "anaglyph",
    "difference",
    "depth",
    "wide_depth",
    "wide_zoom",
    "scene",
  ]),
);
const WINDOWS_ADDRESS = `${ROOT}/windows`;
const LEAST_SHARE = 0.1;
const DEEPEST = SOURCES.length;

/** The layout of an address that has none. @type {Layout} */
export const USUAL_LAYOUT = layoutOf("row-600(wide,column-500(left,right))") ?? "wide";

/** Return the address of a window that shows one source. @param {Source} source */
export function windowAddress(source) {
  return `${WINDOWS_ADDRESS}#${source}`;
}

/** Return the address of a window with a layout, as text. @param {string} layout */
export function layoutAddress(layout) {
  return `${WINDOWS_ADDRESS}#${layout}`;
}

/** Write a layout for an address: `row-600(wide,column-500(left,right))`. @param {Layout} layout @returns {string} */
export function layoutText(layout) {
  if (typeof layout === "string") return layout;
  const [first, second] = layout.parts;
  return `${layout.axis}-${Math.round(layout.share * 1000)}(${layoutText(first)},${layoutText(second)})`;
}

/** Read a layout from an address; null where there is none, or one that cannot be shown. @param {string} text */
export function layoutOf(text) {
  const tokens = text.match(/[a-z_]+(?:-\d+)?|[(),]|./g) ?? [];
  const layout = readLayout(tokens, 0);
  const sources = layout ? sourcesOf(layout) : [];
  return tokens.length > 0 || new Set(sources).size !== sources.length ? null : layout;
}

/**
 * Read a layout from the beginning of the tokens, and remove it there.
 * @param {string[]} tokens
 * @param {number} depth
 * @returns {Layout | null}
 */
function readLayout(tokens, depth) {
  const word = tokens.shift() ?? "";
  if (isSource(word)) return word;
  const split = /^(row|column)-(\d{1,3})$/.exec(word);
  if (!split || depth >= DEEPEST || tokens.shift() !== "(") return null;
  const first = readLayout(tokens, depth + 1);
  if (!first || tokens.shift() !== ",") return null;
  const second = readLayout(tokens, depth + 1);
  if (!second || tokens.shift() !== ")") return null;
  return { axis: /** @type {Axis} */ (split[1]), share: shareWithin(Number(split[2]) / 1000), parts: [first, second] };
}

/** @param {string} word @returns {word is Source} */
function isSource(word) {
  return SOURCES.includes(/** @type {Source} */ (word));
}

/** Return the sources in their order. @param {Layout} layout @returns {Source[]} */
export function sourcesOf(layout) {
  return typeof layout === "string" ? [layout] : layout.parts.flatMap(sourcesOf);
}

/**
 * Return the source that a new pane shows: the first that the board does not; null when it shows all.
 * @param {Layout} layout
 * @param {readonly Source[]} [sources]
 */
export function nextSource(layout, sources = SOURCES) {
  const shown = sourcesOf(layout);
  return sources.find((source) => !shown.includes(source)) ?? null;
}

/**
 * Split the pane of a source in halves; the new pane stands to its right or below it.
 * @param {Layout} layout
 * @param {Source} source
 * @param {Axis} axis
 * @param {Source} added
 */
export function splitPane(layout, source, axis, added) {
  return mapped(layout, (found) => (found === source ? { axis, share: 0.5, parts: [source, added] } : found));
}

/**
 * Close the pane of a source: its neighbour takes its room. The last pane stays.
 * @param {Layout} layout
 * @param {Source} source
 * @returns {Layout}
 */
export function closePane(layout, source) {
  if (typeof layout === "string") return layout;
  const [first, second] = layout.parts;
  if (first === source) return second;
  if (second === source) return first;
  return { ...layout, parts: [closePane(first, source), closePane(second, source)] };
}

/**
 * Show another source in a pane; where it is shown already, the two change places.
 * @param {Layout} layout
 * @param {Source} source
 * @param {Source} other
 */
export function exchangePane(layout, source, other) {
  return mapped(layout, (found) => (found === source ? other : found === other ? source : found));
}

/**
 * Move a divider; `path`: the parts that lead to its split, 0 or 1 each.
 * @param {Layout} layout
 * @param {string} path
 * @param {number} share of the first part
 * @returns {Layout}
 */
export function moveDivider(layout, path, share) {
  if (typeof layout === "string") return layout;
  if (path === "") return { ...layout, share: shareWithin(share) };
  const [first, second] = layout.parts;
  const rest = path.slice(1);
  return {
    ...layout,
    parts: path.startsWith("0") ? [moveDivider(first, rest, share), second] : [first, moveDivider(second, rest, share)],
  };
}

/**
 * Return where every pane and divider stands, in shares of the window.
 * @param {Layout} layout
 * @param {Box} [box]
 * @param {string} [path]
 * @returns {{panes: {source: Source, box: Box}[], dividers: Divider[]}}
 */
export function placesOf(layout, box = { left: 0, top: 0, width: 1, height: 1 }, path = "") {
  if (typeof layout === "string") return { panes: [{ source: layout, box }], dividers: [] };
  const { axis, share, parts } = layout;
  const [one, two] = halves(box, axis, share);
  const first = placesOf(parts[0], one, `${path}0`);
  const second = placesOf(parts[1], two, `${path}1`);
  return {
    panes: [...first.panes, ...second.panes],
    dividers: [{ path, axis, share, box }, ...first.dividers, ...second.dividers],
  };
}

/** @param {Box} box @param {Axis} axis @param {number} share @returns {[Box, Box]} */
function halves({ left, top, width, height }, axis, share) {
  if (axis === "row") {
    const part = width * share;
    return [
      { left, top, width: part, height },
      { left: left + part, top, width: width - part, height },
    ];
  }
  const part = height * share;
  return [
    { left, top, width, height: part },
    { left, top: top + part, width, height: height - part },
  ];
}

/** @param {Layout} layout @param {(source: Source) => Layout} change @returns {Layout} */
function mapped(layout, change) {
  if (typeof layout === "string") return change(layout);
  const [first, second] = layout.parts;
  return { ...layout, parts: [mapped(first, change), mapped(second, change)] };
}

/** @param {number} share */
function shareWithin(share) {
  return Math.min(1 - LEAST_SHARE, Math.max(LEAST_SHARE, share));
}
