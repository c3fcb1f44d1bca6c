// The texts of batches of datasets.

import { count, timeLeft } from "../../elements/format.js";

/** @import { BatchDocument, JobProgress } from "#api" */

/** @type {[string, string][]} */
export const BATCH_KINDS = [
  ["depth", "depth and clouds of every point"],
  ["mosaic", "mosaics"],
  ["export", "exports"],
  ["evaluate", "figures of the depth"],
];

/** @type {[string, string][]} */
export const EXPORTS = [
  ["hugging-face", "Hugging Face"],
  ["colmap", "COLMAP"],
  ["nerfstudio", "nerfstudio"],
  ["ome-zarr", "OME-Zarr"],
  ["authors", "the authors' folders"],
];

/**
 * Return who may make a batch: first the workers of the server's cluster, where it has one.
 * @param {string | null} cluster
 * @returns {[string, string][]}
 */
export function placesOf(cluster) {
  const here = /** @type {[string, string]} */ (["here", "the server"]);
  return cluster === null ? [here] : [["cluster", `the cluster ${cluster}`], here];
}

/** @param {number} ticked */
export function tickedWords(ticked) {
  if (ticked === 0) return "Tick datasets to make something of them together.";
  return `${count(ticked)} ${ticked === 1 ? "dataset" : "datasets"} ticked`;
}

/** @param {JobProgress} [progress] */
export function progressWords({ done, total, eta_s, note } = { done: 0, total: 0, eta_s: null, note: "" }) {
  const step = total > 0 ? `Batch: ${count(done)} of ${count(total)}` : "Batch: reading the datasets";
  return [step, note, timeLeft(eta_s)].filter(Boolean).join(" · ");
}

/** @param {Pick<BatchDocument, "kind" | "planned" | "done" | "failed">} batch */
export function resultWords({ kind, planned, done, failed }) {
  const words = `The last batch (${kind}): ${count(done ?? 0)} of ${count(planned ?? 0)} made`;
  const [first] = failed;
  if (!first) return `${words}.`;
  return `${words}, ${count(failed.length)} failed: ${first.dataset}: ${first.reason}.`;
}
