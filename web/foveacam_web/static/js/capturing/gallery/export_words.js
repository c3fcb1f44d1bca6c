// The texts of a dataset's exports: what each is for, its progress, and the line that loads it. Pure functions.

import { dayTime, sentence, timeLeft } from "../../elements/format.js";
import { sizeWords } from "./dataset_words.js";

/**
 * @import { DatasetExport, JobProgress, MadeExport } from "#api"
 * @typedef {{title: string, purpose: string, load: (folder: string) => string}} ExportWords
 *   `load`: the line that loads the unpacked folder
 */

/** The exports that a dataset's page offers, in their order. @type {Readonly<Partial<Record<DatasetExport["kind"], ExportWords>>>} */
export const EXPORT_KINDS = Object.freeze({
  "hugging-face": {
    title: "Hugging Face",
    purpose: "Rows with the raw pictures, gazes and volts, to train networks and for pandas.",
    load: (folder) => `import datasets; rows = datasets.load_dataset(${JSON.stringify(folder)}, split="train")`,
  },
  colmap: {
    title: "COLMAP",
    purpose: "Pinhole pictures with cameras, poses and sparse points, for reconstruction and meshes.",
    load: (folder) => `colmap gui --import_path ${shellWord(`${folder}/sparse/0`)}`,
  },
  nerfstudio: {
    title: "nerfstudio",
    purpose: "Pictures with poses and seed points, to train radiance fields and Gaussian splats.",
    load: (folder) => `ns-train splatfacto --data ${shellWord(folder)}`,
  },
  "ome-zarr": {
    title: "OME-Zarr",
    purpose: "Raw pictures of each camera at several sizes, for napari, Fiji and zarr.",
    load: (folder) =>
      `import zarr; left = zarr.open_group(${JSON.stringify(`${folder}/left.ome.zarr`)}, mode="r")["0"]`,
  },
});

/** Return a word of a shell's line, quoted where it has to be. @param {string} text */
export function shellWord(text) {
  return /^[\w./-]+$/.test(text) ? text : `'${text.replaceAll("'", `'\\''`)}'`;
}

/** @param {JobProgress | null | undefined} progress */
export function exportProgress(progress) {
  const note = progress?.note ? sentence(progress.note).slice(0, -1) : "Reading the dataset";
  const step = progress?.total ? `step ${progress.done} of ${progress.total}` : "";
  return [note, step, timeLeft(progress?.eta_s)].filter(Boolean).join(" · ");
}

/** @param {MadeExport} made */
export function madeWords({ made_utc, outdated }) {
  const made = `Made ${dayTime(made_utc)}`;
  return outdated ? `${made}; the dataset or the program has changed since.` : `${made}.`;
}

/** Word the size of an export before it is made. @param {number | null} largest_bytes */
export function largestWords(largest_bytes) {
  return largest_bytes === null ? "" : `At most ${sizeWords(largest_bytes)}`;
}
