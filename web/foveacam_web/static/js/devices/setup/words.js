// Values of the draft by field, and the words of steps, cameras and differences. Pure functions.

import { sentence } from "../../elements/format.js";
import { CAMERAS } from "../rig/words.js";

/**
 * @import { AdviceDocument, DraftDocument, FoundCameraDocument, FoundDevices, RigDraft, StartDocument, StartStepDocument } from "#api"
 * @import { Role } from "#page"
 * @typedef {string | number | boolean | null} Value
 * @typedef {{tone: string, text: string}} Note
 */

/** @type {Readonly<Role[]>} */
export const ROLES = Object.freeze(["wide", "left", "right"]);

/** @type {Readonly<Record<string, string>>} */
const STEPS = Object.freeze({
  rig: "Rig file",
  calibration: "Calibration",
  renderer: "Renderer",
  mirrors: "Mirrors' controller",
  ...CAMERAS,
  pan_tilt: "Pan-tilt",
  rail: "Rail",
});

/** @type {Readonly<Record<StartStepDocument["state"], {mark: string, tone: string, word: string}>>} */
export const STATES = Object.freeze({
  pending: { mark: "○", tone: "", word: "waits" },
  active: { mark: "◐", tone: "warn", word: "opens now" },
  done: { mark: "✓", tone: "good", word: "open" },
  failed: { mark: "✗", tone: "bad", word: "failed" },
});

/** @type {Readonly<Record<FoundCameraDocument["kind"], string>>} */
const BUSES = Object.freeze({
  aravis: "GigE or USB3 Vision (Aravis)",
  pylon: "Basler (pylon)",
  opencv: "Video device (OpenCV)",
  simulated: "Simulated bus",
});

/** What starts the exposures of left and right. @type {{value: string, text: string}[]} */
export const TRIGGERS = [
  { value: "hardware", text: "on the controller's pulse" },
  { value: "software", text: "on a command: no trigger cable" },
  { value: "none", text: "all the time" },
];

/** @param {StartStepDocument} step */
export function stepName({ device }) {
  return STEPS[device] ?? device;
}

/** Return how far an active step is: "14 of 23 kernels, about 20 s left". @param {StartStepDocument} step */
export function stepProgress({ state, detail, left_s }) {
  if (state !== "active" || !detail) return "";
  return left_s == null ? detail : `${detail}, about ${roundedSeconds(left_s)} s left`;
}

/** Return a time left to one figure: single seconds below ten, then fives. @param {number} left_s */
function roundedSeconds(left_s) {
  return left_s < 10 ? Math.max(1, Math.round(left_s)) : 5 * Math.round(left_s / 5);
}

/** Return whether the steps of the start are worth showing: it is under way, or stays at what failed. @param {StartDocument | null} start */
export function startStands(start) {
  return Boolean(start?.steps.some(({ state }) => state !== "done"));
}

/** @param {FoundCameraDocument["kind"]} kind */
export function busName(kind) {
  return BUSES[kind];
}

/** Name a camera in a line. @param {Pick<FoundCameraDocument, "vendor" | "model" | "serial" | "kind">} camera */
export function cameraName({ vendor, model, serial, kind }) {
  return `${[vendor, model].filter(Boolean).join(" ") || BUSES[kind]}, ${serial}`;
}

/**
 * Return the cameras that a role may be given: all that were found, and the chosen one, though it is not there.
 * @param {FoundDevices | null} found
 * @param {RigDraft["cameras"][Role]} chosen
 * @returns {{value: string, text: string}[]}
 */
export function cameraChoices(found, chosen) {
  const choices = (found?.cameras ?? []).map((camera) => ({ value: keyOf(camera), text: cameraName(camera) }));
  if (chosen && !choices.some(({ value }) => value === keyOf(chosen)))
    choices.push({ value: keyOf(chosen), text: `${BUSES[chosen.kind]}, ${chosen.name}: not found` });
  return [{ value: "", text: "none" }, ...choices];
}

/** Return a camera's key in a list of choices. @param {{kind: string, name: string}} camera */
export function keyOf({ kind, name }) {
  return `${kind} ${name}`;
}

/** @param {string} key @returns {RigDraft["cameras"][Role]} */
export function cameraOf(key) {
  if (!key) return null;
  const [kind = "", ...rest] = key.split(" ");
  return { kind: /** @type {FoundCameraDocument["kind"]} */ (kind), name: rest.join(" ") };
}

/** Return the role that a draft gives a camera. @param {RigDraft} draft @param {{kind: string, name: string}} camera */
export function roleIn(draft, camera) {
  return ROLES.find((role) => draft.cameras[role] && keyOf(draft.cameras[role]) === keyOf(camera)) ?? null;
}

/** Give a camera a role, or take its role away. @param {RigDraft} draft @param {{kind: FoundCameraDocument["kind"], name: string}} camera @param {Role | null} role */
export function withRole(draft, { kind, name }, role) {
  const cameras = { ...draft.cameras };
  const before = roleIn(draft, { kind, name });
  if (before) cameras[before] = null;
  if (role) cameras[role] = { kind, name };
  return { ...draft, cameras };
}

/** @param {RigDraft} draft @param {string} path @returns {Value} */
export function valueAt(draft, path) {
  let found = /** @type {any} */ (draft); // any: walked by a path of names
  for (const key of path.split(".")) found = found?.[key];
  return found ?? null;
}

/** Return the draft with another value at a path. @param {RigDraft} draft @param {string} path @param {unknown} value @returns {RigDraft} */
export function withValue(draft, path, value) {
  const [table = "", key] = path.split(".");
  if (!key) return /** @type {RigDraft} */ ({ ...draft, [table]: value });
  const inside = /** @type {any} */ (draft)[table] ?? {}; // any: walked by a path of names
  return /** @type {RigDraft} */ ({ ...draft, [table]: { ...inside, [key]: value } });
}

/**
 * Return the messages beside a field: its faults, then the doctor's findings.
 * @param {string} path
 * @param {DraftDocument | null} setup
 * @param {AdviceDocument[] | null} advice
 * @returns {Note[]}
 */
export function notesAt(path, setup, advice) {
  const faults = (setup?.faults ?? []).filter(({ field }) => field === path);
  const found = (advice ?? []).filter(({ field }) => field === path);
  return [
    ...faults.map(({ message }) => ({ tone: "bad", text: sentence(message) })),
    ...found.map(({ level, found: text, remedy }) => ({
      tone: level === "ok" ? "good" : level === "warning" ? "warn" : "bad",
      text: remedy ? `${sentence(text)} To do: ${remedy}` : sentence(text), // a remedy may be a command: as it is
    })),
  ];
}

/** Return the id of a field's element in the page. @param {string} path */
export function fieldId(path) {
  const [table, key] = path.split(".");
  if (table === "cameras") return `setup-role-${key ?? "wide"}`;
  return path === "pan_tilt" ? "setup-pan-tilt-kind" : `setup-${path.replace(".", "-")}`;
}

/** Return how many lines a unified difference changes. @param {string} difference */
export function lineCount(difference) {
  const lines = differenceLines(difference).filter(({ tone, text }) => tone !== "same" && text.slice(1).trim()).length;
  return lines === 1 ? "1 line" : `${lines} lines`;
}

/** Return the faults at none of the fields that the page has. @param {DraftDocument | null} setup @param {Set<string>} fields */
export function otherFaults(setup, fields) {
  return (setup?.faults ?? []).filter(({ field }) => !fields.has(field));
}

/**
 * Split a unified difference into lines with their tone.
 * @param {string} difference
 * @returns {{tone: string, text: string}[]}
 */
export function differenceLines(difference) {
  return difference
    .split("\n")
    .slice(2)
    .filter((line) => line !== "")
    .map((text) => ({ text, tone: text.startsWith("+") ? "added" : text.startsWith("-") ? "removed" : "same" }));
}
