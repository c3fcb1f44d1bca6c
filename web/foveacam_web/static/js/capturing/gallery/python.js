// The lines of Python that read a dataset: from any machine by the server's address, and on the server's own by its path.

import { copiedCode } from "../../elements/copy.js";
import { html } from "../../elements/dom.js";
import { ROOT } from "../../root.js";
import { isNamed } from "../../operating/session/words.js";

/** @import { CaptureDocument, SignInDocument } from "#api" */

/** @param {CaptureDocument} dataset @param {SignInDocument | null} sign_in */
export function pythonOf(dataset, sign_in) {
  const address = `${location.origin}${ROOT}`;
  return html`<div class="stack">
    ${copiedCode(remoteLines(dataset, { address, named: isNamed(sign_in) }), "Python")}
    <p class="note">
      On any machine that reaches ${address}. It needs the client alone, from the sources of FoveaCam Duo:${" "}
      <code>pip install './server/foveacam_client[arrays]'</code>
    </p>
    <details>
      <summary>On the server's own machine</summary>
      <div class="stack">${copiedCode(localLines(dataset), "Python on the server's own machine")}</div>
    </details>
  </div>`;
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
