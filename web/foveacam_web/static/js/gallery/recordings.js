// Opens the recordings tab: the list, or one recording.

import { nothing } from "../calibration/parts.js";
import { openRecording } from "./recording_page.js";
import { openRecordingList } from "./recordings_list.js";

/**
 * @param {import("#page").GalleryPlace} at
 * @param {import("./tabs.js").GalleryContext} context
 * @returns {HTMLElement}
 */
export function openRecordings(at, context) {
  if (at.id === null) return openRecordingList(context);
  return at.part === null ? openRecording(at.id, context) : nothing("There is no such page.");
}
