// The tab of datasets: all of them, one of them, or another page about one.

import { nothing } from "../calibration/parts.js";
import { DATASET_PARTS } from "./dataset_parts.js";

/**
 * @typedef {import("./context.js").GalleryContext} GalleryContext
 * @typedef {import("./documents.js").GalleryPlace} GalleryPlace
 */

/**
 * @param {GalleryPlace} at
 * @param {GalleryContext} context
 * @returns {HTMLElement}
 */
export function openDatasets(at, context) {
  const part = DATASET_PARTS.find(({ name }) => name === at.part);
  if (at.id !== null && part) return part.open(at, context);
  return nothing("No dataset yet.");
}
