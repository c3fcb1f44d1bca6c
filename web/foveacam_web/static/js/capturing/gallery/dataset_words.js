// Words for the states, plans and conditions of datasets; unknown fields are left out. Pure functions.

import { angle, count, dayTime, MISSING, number, sentence, span } from "../../elements/format.js";

/**
 * @import { ArchivedDocument, CaptureDocument, PointDocument } from "#api"
 * @typedef {Record<string, unknown>} Json
 */

/** @type {Readonly<Record<CaptureDocument["state"], {text: string, tone: string}>>} */
const STATES = Object.freeze({
  starting: { text: "Starting", tone: "plain mine" },
  running: { text: "Running", tone: "plain mine" },
  paused: { text: "Paused", tone: "warn" },
  complete: { text: "Complete", tone: "good" },
  partial: { text: "Partial", tone: "warn" },
  damaged: { text: "Cannot be read", tone: "bad" },
});

/** @type {Readonly<Record<string, string>>} */
const PHASES = Object.freeze({
  survey: "measuring how far the scene is",
  rail: "moving on the rail",
  paused: "waiting",
  closing: "writing the last points",
});

const CAMERAS = Object.freeze(
  /** @type {[string, string][]} */ ([
    ["wide", "Wide camera"],
    ["left", "Left fovea"],
    ["right", "Right fovea"],
  ]),
);

/** Return the path of a capture below /api/v1. @param {string} id @param {string} [rest] */
export function capturePath(id, rest = "") {
  return `/captures/${encodeURIComponent(id)}${rest}`;
}

/** @param {CaptureDocument} dataset */
export function stateWords({ state }) {
  return STATES[state] ?? { text: state, tone: "plain" };
}

/** @param {Pick<CaptureDocument, "state">} dataset */
export function isLive({ state }) {
  return state === "starting" || state === "running" || state === "paused";
}

/** @param {CaptureDocument} dataset */
export function pointsWords({ points, state }) {
  if (state === "damaged" || points.planned === 0) return "";
  const taken =
    points.taken === points.planned
      ? `${count(points.taken)} points`
      : `${count(points.taken)} of ${count(points.planned)} points`;
  return [taken, points.skipped > 0 && `${count(points.skipped)} passed over`].filter(Boolean).join(", ");
}

/** Word the progress of a running capture. @param {CaptureDocument} dataset */
export function progressWords({ progress, why }) {
  if (why) return sentence(why);
  if (!progress) return "Waiting for the rig.";
  const left = progress.left_s === null ? "" : `${span(progress.left_s)} left`;
  return [`${count(progress.done)} of ${count(progress.total)}`, PHASES[progress.phase], left]
    .filter(Boolean)
    .join(" · ");
}

/** @param {number} bytes */
export function sizeWords(bytes) {
  if (bytes < 1e6) return `${number(bytes / 1e3, 0)} kB`;
  return bytes < 1e9 ? `${number(bytes / 1e6, 1)} MB` : `${number(bytes / 1e9, 2)} GB`;
}

/** @param {PointDocument} point */
export function pointWords({ aim_ax_deg, aim_ay_deg, distance_m, rail_mm, scan }, scans = 1) {
  const aim = aim_ax_deg === null ? "" : `${angle(aim_ax_deg)} across, ${angle(aim_ay_deg)} down`;
  const met =
    aim_ax_deg === null ? "" : distance_m === null ? "eyes parallel" : `eyes meet at ${number(distance_m, 2)} m`;
  return [scans > 1 && `scan ${scan + 1}`, aim, met, rail_mm !== null && `rail at ${number(rail_mm, 1)} mm`]
    .filter(Boolean)
    .join(" · ");
}

/** @param {CaptureDocument} dataset @returns {[string, string][]} names and values */
export function factRows(dataset) {
  const { scans, frames } = dataset.points;
  return filled([
    ["Taken", dayTime(dataset.created_utc)],
    ["Points", pointsWords(dataset)],
    ["Pictures", frames > 0 ? [count(frames), scans > 1 && `in ${count(scans)} scans`].filter(Boolean).join(" ") : ""],
    ["Size", dataset.size_bytes > 0 ? sizeWords(dataset.size_bytes) : ""],
    ["Format", dataset.codec ? dataset.codec.toUpperCase() : ""],
    ["Rig", dataset.rig_id ?? ""],
    ["Id", dataset.id],
    ["Folder", dataset.folder],
  ]);
}

/** Return the rows that have a value. @param {[string, string][]} rows */
export function filled(rows) {
  return rows.filter(([, value]) => value !== "");
}

/**
 * Return the lines that read a dataset from a server.
 * @param {Pick<CaptureDocument, "id">} dataset
 * @param {{address: string, named: boolean}} server `named`: whether it asks who somebody is
 */
export function remoteLines({ id }, { address, named }) {
  const token = named ? ", token=TOKEN" : "";
  return [
    "import foveacam_client",
    named && 'TOKEN = "fcd_…"  # of a service, made on the page People',
    `rig = foveacam_client.connect(${JSON.stringify(address)}${token})`,
    `dataset = rig.dataset(${JSON.stringify(id)})`,
    "point = dataset[0]  # .left, .right, .wide: arrays",
    "print(len(dataset), point)",
  ]
    .filter(Boolean)
    .join("\n");
}

/** Return the lines that load a dataset by its real path. @param {Pick<CaptureDocument, "folder" | "points" | "calibration_id">} dataset */
export function localLines({ folder, points, calibration_id }) {
  const calibrated = calibration_id !== null;
  return [
    "from foveacam_pipeline.capture.dataset import Dataset",
    `dataset = Dataset.open(${JSON.stringify(folder)})`,
    `point = dataset[${Math.floor(points.taken / 2)}]`,
    `print(len(dataset), point.left.shape, ${calibrated ? "point.pose.left_rad, dataset.calibration.id" : "point.right.shape"})`,
    calibrated ? "pair = point.rectified(scale=0.5)" : "wide = point.wide",
  ].join("\n");
}

/** @param {Json | null} plan @returns {string[]} a sentence each */
export function planWords(plan) {
  if (!plan) return [];
  return [
    sourceWords(part(plan["points"])),
    vergingWords(part(plan["verging"])),
    exposureWords(plan),
    WIDES[String(plan["wide"])] ?? "",
    railWords(plan["rail_positions_mm"]),
  ].filter((words) => words !== "");
}

/** @type {Readonly<Record<string, string>>} */
const WIDES = Object.freeze({
  point: "A wide picture with every point.",
  scan: "One wide picture a scan.",
  none: "No wide pictures.",
});

/** @param {Json} source */
function sourceWords(source) {
  if (source["kind"] === "set_points")
    return `${count(listOf(source["points"], () => true).length)} set points, in their order.`;
  const { columns, rows, half_width_deg, half_height_deg, centre_ax_deg, centre_ay_deg } = source;
  if (typeof columns !== "number" || typeof rows !== "number") return "";
  const order = source["order"] === "rows" ? "every row from the left" : "every other row backwards";
  const range = (/** @type {unknown} */ middle, /** @type {unknown} */ half) =>
    typeof half === "number"
      ? `${angle(Number(middle ?? 0) - half, 1)} … ${angle(Number(middle ?? 0) + half, 1)}`
      : "as far as the rig steers";
  return `${columns} × ${rows} points, ${order}: ${range(centre_ax_deg, half_width_deg)} across, ${range(centre_ay_deg, half_height_deg)} down.`;
}

/** @param {Json} verging */
function vergingWords({ mode, distance_m, each_point }) {
  const where =
    distance_m === "infinity"
      ? "Both eyes look parallel"
      : typeof distance_m === "number"
        ? `Both eyes meet at ${number(distance_m, 2)} m${mode === "scene" ? ", the scene's average as it was measured" : ""}`
        : mode === "scene"
          ? "Both eyes meet at the scene's average distance"
          : "";
  return where && `${where}${each_point === true ? "; verged again at every point" : ""}.`;
}

/** @param {Json} plan */
function exposureWords({ exposures_ms, stack_frames, stack_keep }) {
  if (!Array.isArray(exposures_ms)) return "";
  const bracket = listOf(exposures_ms, (value) => typeof value === "number");
  const exposures =
    bracket.length > 0
      ? `${bracket.length === 1 ? "Exposed for" : "Bracket of"} ${bracket.map((each) => plain(Number(each))).join(", ")} ms`
      : "Exposed as the cameras were set";
  const stack =
    typeof stack_frames === "number" && stack_frames > 1
      ? `, ${stack_frames} frames each, ${stack_keep === "all" ? "all kept" : "kept as their mean"}`
      : "";
  return `${exposures}${stack}.`;
}

/** @param {unknown} positions_mm */
function railWords(positions_mm) {
  const places = listOf(positions_mm, (value) => typeof value === "number");
  if (places.length === 0) return "";
  return `${places.length} ${places.length === 1 ? "scan" : "scans"}, from ${places.map((each) => number(Number(each), 0)).join(", ")} mm on the rail.`;
}

/** @param {Json | null} conditions @returns {[string, string][]} names and values */
export function conditionRows(conditions) {
  if (!conditions) return [];
  const { scene, settle_us, low_pass_hz, rail_m, pan_rad, tilt_rad, survey_distances_m } = conditions;
  const cameras = part(conditions["cameras"]);
  const survey = listOf(survey_distances_m, () => true).map((each) =>
    typeof each === "number" ? number(each, 2) : MISSING,
  );
  return filled([
    ["Scene", typeof scene === "string" ? scene : ""],
    ["Wait after a move", typeof settle_us === "number" ? `${plain(settle_us / 1e3)} ms` : ""],
    ["Low pass of the mirrors", typeof low_pass_hz === "number" ? `${plain(low_pass_hz)} Hz` : ""],
    ...CAMERAS.map(([role, name]) => /** @type {[string, string]} */ ([name, cameraWords(part(cameras[role]))])),
    ["Rail", typeof rail_m === "number" ? `${number(1e3 * rail_m, 1)} mm` : ""],
    [
      "Pan, tilt",
      typeof pan_rad === "number" && typeof tilt_rad === "number"
        ? `${angle(degrees(pan_rad))}, ${angle(degrees(tilt_rad))}`
        : "",
    ],
    ["Scene measured at", survey.length > 0 ? `${survey.join(", ")} m` : ""],
  ]);
}

/** @param {Json} settings */
function cameraWords({ exposure_ns, gain_db, pixel_format, frame_rate_hz }) {
  return [
    typeof exposure_ns === "number" && `${plain(exposure_ns / 1e6)} ms`,
    typeof gain_db === "number" && `${plain(gain_db)} dB`,
    typeof pixel_format === "string" && pixel_format,
    typeof frame_rate_hz === "number" && `${plain(frame_rate_hz)} Hz`,
  ]
    .filter(Boolean)
    .join(", ");
}

/** @param {number} rad */
function degrees(rad) {
  return (180 / Math.PI) * rad;
}

/** @param {number} value */
function plain(value) {
  return String(Number(value.toPrecision(4)));
}

/** @param {unknown} value @returns {Json} empty for what is no object */
function part(value) {
  return value !== null && typeof value === "object" ? /** @type {Json} */ (value) : {};
}

/** @param {unknown} value @param {(each: unknown) => boolean} fits @returns {unknown[]} empty for what is no list */
function listOf(value, fits) {
  return Array.isArray(value) ? value.filter(fits) : [];
}

/** @param {ArchivedDocument} archived */
export function archivedWords({ utc, bytes, local }) {
  const where = local ? "All of it is here as well." : "Only what is small is here; the rest is read from there.";
  return `${sizeWords(bytes)}, ${dayTime(utc)}. ${where}`;
}
