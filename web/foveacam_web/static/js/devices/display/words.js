// Texts of the display page: its pattern, its scale, and why the size shown is not true. Pure functions.

import { number } from "../../elements/format.js";
import { isTooLarge } from "./scale.js";

/**
 * @import { PatternDocument } from "#api"
 * @typedef {{width_px: number, height_px: number, px_per_mm: number | null}} Screen device pixels
 */

const DEVICES = ["iPad", "iPhone", "Android", "Windows", "CrOS", "Macintosh", "Linux"]; // an Android is a Linux too

/** Return the device of a browser; null for an unknown one. @param {string} agent */
export function deviceOf(agent) {
  const found = DEVICES.find((device) => agent.includes(device)) ?? null;
  return found === "Macintosh" ? "Mac" : found === "CrOS" ? "Chromebook" : found;
}

/** Name a screen by its device, as the list of displays shows it. @param {string} agent */
export function nameOf(agent) {
  const device = deviceOf(agent);
  return device ? `Display on ${device}` : "Display";
}

/** @param {PatternDocument | null} shown */
export function shownWords(shown) {
  if (!shown) return "Waiting for the pattern.";
  return shown.pattern.kind === "blank"
    ? "Blank: choose a pattern on the calibration page."
    : capital(shown.description);
}

/** @param {Screen} screen */
export function scaleWords({ width_px, height_px, px_per_mm }) {
  return px_per_mm === null
    ? "Scale not set"
    : `${number(px_per_mm, 3)} px/mm · ${number(width_px / px_per_mm, 0)} × ${number(height_px / px_per_mm, 0)} mm`;
}

/**
 * Return why the pattern is not shown, or not in its true size; null otherwise.
 * @param {Screen & {shown: PatternDocument | null, zoom: number}} of
 */
export function warningWords({ shown, width_px, height_px, px_per_mm, zoom }) {
  if (px_per_mm === null) return "The size is not true yet: lay a bank card or a ruler on the screen and set it.";
  if (Math.abs(zoom - 1) > 1e-3) return "The page is magnified, so the size is not true: zoom out.";
  if (shown === null || shown.width_mm === null || shown.height_mm === null) return null;
  const { width_mm, height_mm } = shown;
  if (!isTooLarge({ width_mm, height_mm, width_px, height_px, px_per_mm })) return null;
  const screen = `${number(width_px / px_per_mm, 1)} × ${number(height_px / px_per_mm, 1)} mm`;
  return (
    `Not shown, as it does not fit: ${number(width_mm, 1)} × ${number(height_mm, 1)} mm are requested, ` +
    `the page has ${screen}. Use the full screen, turn it, or choose a smaller pattern.`
  );
}

/** @param {string} text */
function capital(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}
