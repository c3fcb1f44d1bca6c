// How both foveae are shown: each in its pane, one of them, or both in one picture. Pure functions on layouts.

import { closePane, exchangePane, sourcesOf, splitPane } from "../../operating/windows/layout.js";

/**
 * @import { PlayerLayout } from "#api"
 * @import { Layout, Source } from "#page"
 * @typedef {PlayerLayout["stereo"]} StereoMode
 */

/** The sources of the player's panes. @type {readonly Source[]} */
export const SOURCES = Object.freeze(/** @type {Source[]} */ (["wide", "left", "right", "anaglyph", "difference"]));

/** @type {readonly [StereoMode, string][]} */
export const MODES = Object.freeze([
  ["off", "Off: both eyes"],
  ["left", "Left eye"],
  ["right", "Right eye"],
  ["anaglyph", "Anaglyph"],
  ["difference", "Difference"],
]);

/** @type {Readonly<Record<StereoMode, Source[]>>} */
const SHOWN = Object.freeze({
  off: ["left", "right"],
  left: ["left"],
  right: ["right"],
  anaglyph: ["anaglyph"],
  difference: ["difference"],
});

/** @param {Source} source */
function isEye(source) {
  return source !== "wide";
}

/**
 * Return a layout that shows the foveae in another way; the wide view stays where it is.
 * @param {Layout} layout
 * @param {StereoMode} mode
 * @returns {Layout}
 */
export function withStereo(layout, mode) {
  const [first = "left", second] = SHOWN[mode];
  const [kept, ...others] = sourcesOf(layout).filter(isEye);
  let found = others.reduce((rest, source) => closePane(rest, source), layout);
  if (!kept) found = splitPane(found, "wide", "row", first);
  else if (kept !== first) found = exchangePane(found, kept, first);
  return second ? splitPane(found, first, "column", second) : found;
}

/** Return the mode that a layout shows. @param {Layout} layout @returns {StereoMode} */
export function stereoOf(layout) {
  const eyes = sourcesOf(layout).filter(isEye);
  const [only] = eyes;
  const mode = MODES.find(([name]) => name === only);
  return eyes.length === 1 && mode ? mode[0] : "off";
}

/** Return whether a layout is one of the player's. @param {Layout | null} layout */
export function isShowable(layout) {
  return layout !== null && sourcesOf(layout).every((source) => SOURCES.includes(source));
}
