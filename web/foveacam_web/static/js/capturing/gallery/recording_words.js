// Words for recordings. Pure functions.

import { count, number, sentence, span } from "../../elements/format.js";
import { sizeWords } from "./dataset_words.js";

/**
 * @import { RecordedStreamDocument, RecordingDocument } from "#api"
 * @import { Role } from "#page"
 */

/** @type {Readonly<Record<RecordingDocument["state"], {text: string, tone: string}>>} */
const STATES = Object.freeze({
  starting: { text: "Starting", tone: "plain mine" },
  recording: { text: "Recording", tone: "bad" },
  ending: { text: "Ending", tone: "plain mine" },
  complete: { text: "Complete", tone: "good" },
  partial: { text: "Ended early", tone: "warn" },
  truncated: { text: "Cut off", tone: "warn" },
  damaged: { text: "Cannot be read", tone: "bad" },
});

/** @type {Readonly<Record<Role, string>>} */
export const CAMERAS = Object.freeze({ wide: "Wide", left: "Left", right: "Right" });

/** @type {Readonly<Record<string, string>>} */
const LOSSES = Object.freeze({
  queue: "the disk was slower than the cameras",
  format: "the camera's format had changed",
  disk: "writing to the disk failed",
  closed: "they came after the end",
  deadline: "they were still queued at the deadline of the end",
});

/** Return the path of a recording below /api/v1. @param {string} id @param {string} [rest] */
export function recordingPath(id, rest = "") {
  return `/recordings/${encodeURIComponent(id)}${rest}`;
}

/** @param {RecordingDocument} recording */
export function stateWords({ state, ended }) {
  if (state === "complete" && ended === "disk_reserve") return STATES.partial;
  return STATES[state] ?? { text: state, tone: "plain" };
}

/** @param {RecordingDocument} recording */
export function isBeingMade({ state }) {
  return state === "starting" || state === "recording" || state === "ending";
}

/** @param {RecordingDocument} recording */
export function droppedOf({ streams }) {
  return streams.reduce((sum, { dropped }) => sum + (dropped ?? 0), 0);
}

/** @param {RecordingDocument} recording */
function framesOf({ streams }) {
  return streams.reduce((sum, { frames }) => sum + frames, 0);
}

/** @param {RecordingDocument} recording */
export function tallyWords(recording) {
  const dropped = droppedOf(recording);
  const counted = recording.streams.some((stream) => stream.dropped !== null);
  return [
    `${count(framesOf(recording))} frames`,
    counted && (dropped > 0 ? `${count(dropped)} dropped` : "none dropped"),
    sizeWords(recording.size_bytes),
  ]
    .filter(Boolean)
    .join(", ");
}

/**
 * Word when a running recording ends by itself, and how long the disk has room for it.
 * @param {RecordingDocument} recording
 */
export function boundWords({ left_s, room_s, room_bytes }) {
  const room = room_bytes != null && `room for ${room_s == null ? "" : `${span(room_s)}, `}${sizeWords(room_bytes)}`;
  return [left_s != null && `ends by itself in ${clockWords(left_s, 0)}`, room].filter(Boolean).join("; ");
}

/** Return why frames of a camera are missing in the file; empty when none is. @param {RecordedStreamDocument} stream */
export function lossWords({ losses }) {
  return sentence(
    Object.entries(losses)
      .filter(([, lost]) => lost > 0)
      .map(([reason, lost]) => `${count(lost)}: ${LOSSES[reason] ?? reason}`)
      .join("; "),
  );
}

/** Format seconds as minutes and seconds. @param {number} seconds @param {number} [decimals] */
export function clockWords(seconds, decimals = 2) {
  const scale = 10 ** decimals;
  const whole = Math.floor(Math.max(0, seconds) * scale + 1e-6) / scale;
  const minutes = Math.floor(whole / 60);
  const rest = (whole - 60 * minutes).toFixed(decimals).padStart(decimals > 0 ? 3 + decimals : 2, "0");
  if (minutes < 60) return `${minutes}:${rest}`;
  return `${Math.floor(minutes / 60)}:${String(minutes % 60).padStart(2, "0")}:${rest}`;
}

/** Return the default name of a recording: date and time. @param {Date} when */
export function momentName(when) {
  const two = (/** @type {number} */ value) => String(value).padStart(2, "0");
  const day = [when.getFullYear(), two(when.getMonth() + 1), two(when.getDate())].join("-");
  return `${day} ${[when.getHours(), when.getMinutes(), when.getSeconds()].map(two).join("-")}`;
}

/** @param {RecordedStreamDocument} stream */
export function sizeOf({ width, height, pixel_format }) {
  return width === null || height === null ? "" : `${width} × ${height} ${pixel_format ?? ""}`.trim();
}

/** @param {number} fps */
export function rateWords(fps) {
  return fps > 0 ? `${number(fps, 1)} Hz` : "";
}
