// Words for stills. Pure functions.

import { angle, count, millis, number, sentence } from "../../elements/format.js";

/** @import { StillCamera, StillDocument } from "#api" */

export const CAMERAS = Object.freeze(/** @type {const} */ ({ wide: "Wide", left: "Left eye", right: "Right eye" }));

/** Word the frames of one camera: their number, bit depth, exposure and gaze. @param {StillCamera} camera */
export function cameraWords({ asked, came, bits, exposure_ms, gain_db, ax_deg, ay_deg }) {
  if (came === 0) return `none of ${count(asked)} frames`;
  const frames =
    came < asked ? `${count(came)} of ${count(asked)} frames` : came === 1 ? "1 frame" : `${count(came)} frames`;
  const looked = ax_deg === null ? "" : `${angle(ax_deg)} across, ${angle(ay_deg)} down`;
  return [
    frames,
    `${bits} bits`,
    exposure_ms !== null && millis(exposure_ms),
    gain_db !== null && gain_db !== 0 && `${number(gain_db, 1)} dB`,
    looked,
  ]
    .filter(Boolean)
    .join(" · ");
}

/** Word why fewer frames arrived than were requested, one sentence a camera. @param {StillDocument} still */
export function missingWords({ cameras }) {
  return cameras
    .filter(({ came, asked }) => came < asked)
    .map(
      ({ camera, came, asked, detail }) =>
        `${CAMERAS[camera]}: ${came === 0 ? "none" : count(came)} of ${count(asked)} frames came. ${sentence(detail)}`,
    );
}

/** Summarise a still in a few words. @param {StillDocument} still */
export function stillWords({ cameras, stack_frames, stack_keep }) {
  const names = cameras.filter(({ came }) => came > 0).map(({ camera }) => CAMERAS[camera].toLowerCase());
  const stack =
    stack_frames === 1
      ? "one frame each"
      : `${count(stack_frames)} frames each, ${stack_keep === "all" ? "all kept" : "their mean"}`;
  return [names.join(", "), stack].filter(Boolean).join(" · ");
}

/** @param {StillDocument} still */
export function crossingWords({ distance_m }) {
  return distance_m === null ? "nowhere in front of the rig" : `${number(distance_m, 2)} m in front of the rig`;
}
