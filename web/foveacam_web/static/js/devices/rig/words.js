// Words for the states, settings and test verdicts of the rig's devices. Pure functions.

import { number, sentence, span } from "../../elements/format.js";
import { binningText, sizeText } from "../../video/resolution.js";
import { plainly } from "./scale.js";

/**
 * @import { CameraDocument, CameraLinkDocument, RigBinningDocument, RigDocument } from "#api"
 * @import { CameraNumber, CameraPhase, Role, SettingName } from "#page"
 * @typedef {import("#api").EyeTestDocument["verdict"]} Verdict
 */

/** @type {Readonly<Record<Role, string>>} */
export const CAMERAS = Object.freeze({ wide: "Wide camera", left: "Left fovea", right: "Right fovea" });

/** @type {Readonly<Record<CameraPhase, {text: string, tone: string, usual: string}>>} `usual`: where the server gives no reason */
const PHASES = Object.freeze({
  closed: { text: "Closed", tone: "", usual: "It has not been opened." },
  opening: { text: "Opening", tone: "warn", usual: "It is being opened and set up." },
  ready: { text: "Ready", tone: "good", usual: "Open and set up, not started." },
  streaming: { text: "Streaming", tone: "good", usual: "" },
  degraded: { text: "Degraded", tone: "warn", usual: "It delivers, but frames are missing or broken." },
  lost: { text: "Lost", tone: "bad", usual: "It does not answer." },
  backoff: {
    text: "Lost, trying again",
    tone: "bad",
    usual: "It is opened again by itself; nothing needs to be restarted.",
  },
});

/** @type {Readonly<Record<SettingName | CameraNumber, {name: string, unit: string}>>} */
export const SETTINGS = Object.freeze({
  exposure_ms: { name: "Exposure", unit: "ms" },
  exposure_auto: { name: "Automatic exposure", unit: "" },
  gain_db: { name: "Gain", unit: "dB" },
  black_level: { name: "Black level", unit: "" },
  frame_rate_hz: { name: "Frame rate", unit: "Hz" },
  pixel_format: { name: "Pixel format", unit: "" },
  trigger: { name: "Trigger", unit: "" },
});

/** @type {Readonly<Record<Verdict, {text: string, tone: string, meaning: string}>>} */
export const VERDICTS = Object.freeze({
  untested: { text: "Untested", tone: "plain", meaning: "This eye has not been tested yet." },
  ok: { text: "OK: hardware and software", tone: "good", meaning: "The controller's pulse exposes it. Nothing to do." },
  ok_software_only: {
    text: "OK: software only",
    tone: "warn",
    meaning: "Commands expose it; its trigger line was not tested, because no pulse could be given or it takes none.",
  },
  camera: {
    text: "Camera",
    tone: "bad",
    meaning: "Not even a command exposes it. Look at the camera itself: its cable, its power, its settings.",
  },
  wiring: {
    text: "Wiring",
    tone: "bad",
    meaning: "Pulses do not expose it. Look at the trigger and strobe cables between controller and camera.",
  },
  no_probe: {
    text: "No probe",
    tone: "warn",
    meaning: "It could not be tested: it takes no commands, and no pulse could be given.",
  },
});

/** @param {CameraDocument | undefined} camera */
export function linkOf(camera) {
  return (
    camera?.link ??
    /** @type {CameraLinkDocument} */ ({
      phase: camera?.connected ? "streaming" : "closed",
      reason: "",
      since_s: null,
      epoch: 0,
    })
  );
}

/** @param {CameraLinkDocument} link */
export function phaseWords({ phase }) {
  return PHASES[phase] ?? { text: phase, tone: "", usual: "" };
}

/**
 * Word how long a link has been in its phase, and why.
 * @param {CameraLinkDocument} link
 * @returns {{since: string, reason: string}}
 */
export function linkWords(link) {
  const since = link.since_s === null ? "" : `for ${span(link.since_s)}`;
  return { since, reason: sentence(link.reason) || phaseWords(link).usual };
}

/** Return whether a camera accepts settings now. @param {CameraDocument | undefined} camera */
export function takesOrders(camera) {
  return Boolean(camera?.connected && camera.settings && camera.ranges?.pixel_formats.length);
}

/** Return the rig's problem that concerns a camera, if any. @param {RigDocument | null} rig @param {Role} role */
export function problemOf(rig, role) {
  return rig?.problems.find(({ device }) => device.includes(role)) ?? null;
}

/** Format a setting's value with its unit. @param {SettingName} setting @param {number | string} value */
export function settingText(setting, value) {
  if (typeof value === "string") return value === "none" ? "free running" : value;
  return [plainly(value), SETTINGS[setting].unit].filter(Boolean).join(" ");
}

/**
 * Return the settings in which the foveae differ, without the trigger, which only the rig file sets.
 * @param {RigDocument | null} rig
 */
export function settable(rig) {
  return (rig?.divergence ?? []).filter(({ setting }) => setting !== "trigger");
}

/**
 * Word the working binning: the size of its pictures, what a switch costs, and what is in its way.
 * @param {RigBinningDocument} binning
 * @param {Pick<CameraDocument, "width" | "height"> | null} sensor of a camera, where its size is known
 */
export function binningWords({ working_binning, in_force, held_by, problem, switch_s }, sensor) {
  const what = "Looks, following and live views have";
  const [width, height] = [sensor?.width, sensor?.height];
  const own = binningText(working_binning);
  const whole = width && height ? sizeText(width, height) : "";
  const half = width && height ? `: ${sizeText(Math.floor(width / 2), Math.floor(height / 2))} of ${whole}` : "";
  return {
    size:
      working_binning === 1
        ? `${what} every pixel of the sensors${whole && `: ${whole}`}.`
        : `${what} ${own} pixels as one${half}. Stills, captures, calibrations and recordings have every pixel.`,
    cost:
      switch_s === null
        ? "Not switched yet: how long that takes is not known."
        : `Switching took ${switch_s < 0.01 ? "less than 0.01" : number(switch_s, 2)} s.`,
    held: held_by && in_force ? `${binningText(in_force)} now, for ${held_by}; ${own} after it.` : "",
    problem: problem ? `The cameras stay as they are: ${sentence(problem)}` : "",
  };
}
