// Words the resolution of what the cameras deliver, and their binning. Pure functions.

import { number } from "../elements/format.js";

/** @import { CameraDocument, CloudDocument } from "#api" */

/**
 * Word the resolution of a camera's pictures, as the camera delivers them, and what a pixel of them is; null while the
 * camera's size is not known.
 * @param {Pick<CameraDocument, "width" | "height" | "px_per_deg"> | undefined} camera its sensor
 * @param {number} binning of the picture that is shown
 * @returns {{text: string, meaning: string} | null}
 */
export function resolutionWords(camera, binning) {
  if (!camera?.width || !camera.height) return null;
  const whole = sizeText(camera.width, camera.height);
  const size = sizeText(Math.floor(camera.width / binning), Math.floor(camera.height / binning));
  const meaning =
    binning === 1
      ? `Every pixel of the sensor: ${whole}`
      : `${binningText(binning)} pixels are one: ${size} of ${whole}`;
  if (camera.px_per_deg == null)
    return { text: size, meaning: `${meaning}. Pixels a degree are not known without a calibration` };
  const px_per_deg = camera.px_per_deg / binning;
  return { text: `${number(px_per_deg, px_per_deg < 10 ? 1 : 0)} px/°`, meaning };
}

/** @param {number} binning */
export function binningText(binning) {
  return `${binning}×${binning}`;
}

/** @param {number} width @param {number} height */
export function sizeText(width, height) {
  return `${width}×${height}`;
}

/**
 * Word the size of the look that a cloud is from, and of its depth where that is smaller, to follow who computed it;
 * empty where they are not known.
 * @param {Pick<CloudDocument, "look_width" | "look_height" | "depth_width" | "depth_height">} cloud
 */
export function ofLook({ look_width, look_height, depth_width, depth_height }) {
  if (!look_width || !look_height || !depth_width || !depth_height) return "";
  const at = depth_width < look_width ? ` at ${sizeText(depth_width, depth_height)}` : "";
  return `${at}, of a look at ${sizeText(look_width, look_height)}`;
}
