// Tracks of a recording: order, which are on, and the text of a pane whose track has no frame. Pure functions.

import { clockWords } from "../gallery/recording_words.js";
import { count } from "../../elements/format.js";

/**
 * @import { PlayerLayout, TrackDocument } from "#api"
 * @typedef {{track: TrackDocument, on: boolean}} Row one track in its place
 */

/** @type {Readonly<Record<string, string>>} */
const CAMERAS = Object.freeze({ wide: "Wide", left: "Left", right: "Right" });

/** Return what a track is called on the page. @param {TrackDocument} track */
export function trackName({ kind, name, role }) {
  if (kind === "telemetry") return "Telemetry";
  if (kind === "boxes") return `Boxes ${name}`;
  return role ? (CAMERAS[role] ?? name) : name;
}

/** Return the tracks as they were arranged; those that the arrangement does not name come after it. @param {TrackDocument[]} tracks @param {PlayerLayout["tracks"]} arranged @returns {Row[]} */
export function rowsOf(tracks, arranged) {
  const place = new Map(arranged.map(({ name }, index) => [name, index]));
  const on = new Map(arranged.map((one) => [one.name, one.on]));
  return tracks
    .map((track, index) => ({ track, index }))
    .sort((a, b) => (place.get(keyOf(a.track)) ?? 1000 + a.index) - (place.get(keyOf(b.track)) ?? 1000 + b.index))
    .map(({ track }) => ({ track, on: on.get(keyOf(track)) ?? true }));
}

/** Return the name by which an arrangement knows a track. @param {TrackDocument} track */
export function keyOf({ kind, name }) {
  return `${kind}:${name}`;
}

/** Return the arrangement of tracks. @param {Row[]} rows */
export function arrangementOf(rows) {
  return rows.map(({ track, on }) => ({ name: keyOf(track), on }));
}

/** Return the tracks with one of them in another place. @param {Row[]} rows @param {number} from @param {number} to */
export function reordered(rows, from, to) {
  const row = rows[from];
  const target = Math.min(Math.max(to, 0), rows.length - 1);
  if (!row || from === target) return rows;
  const rest = rows.filter((one) => one !== row);
  return [...rest.slice(0, target), row, ...rest.slice(target)];
}

/** Say what a track holds, for its title. @param {TrackDocument} track */
export function trackWords(track) {
  const { count: frames, period_s, runs, drops } = track;
  const missing = drops.reduce((sum, [, , lost]) => sum + lost, 0);
  return [
    `${trackName(track)}: ${count(frames)} ${track.kind === "frames" ? "frames" : "messages"}`,
    period_s !== null && period_s > 0 && `${(1 / period_s).toFixed(1)} Hz`,
    runs.length > 1 && `${count(runs.length - 1)} ${runs.length === 2 ? "gap" : "gaps"}`,
    missing > 0 && `${count(missing)} missing by its period`,
  ]
    .filter(Boolean)
    .join(", ");
}

/**
 * Say why a track has no frame at a moment; empty where it has one.
 * @param {TrackDocument} track
 * @param {number} at_s
 */
export function absenceOf(track, at_s) {
  const { runs, period_s } = track;
  const slack_s = Math.max(2 * (period_s ?? 0), 0.05);
  const [first, last] = [runs[0], runs[runs.length - 1]];
  if (!first || !last) return "It holds no frame.";
  if (at_s < first[0] - slack_s) return `It begins at ${clockWords(first[0])}.`;
  if (at_s > last[1] + slack_s) return `It ends at ${clockWords(last[1])}.`;
  const next = runs.findIndex(([, end]) => end + slack_s >= at_s);
  const [run, before] = [runs[next], runs[next - 1]];
  if (!run || !before || run[0] - slack_s <= at_s) return "";
  return `Nothing came from ${clockWords(before[1])} to ${clockWords(run[0])}.`;
}
