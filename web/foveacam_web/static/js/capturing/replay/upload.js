// Sends a recording to the server in parts, so that no part takes long and a lost connection costs one of them.

import { RequestError, request } from "../../transport/api.js";

/** @import { RecordingDocument, UploadDocument } from "#api" */

const PART_MS = 120_000;
const TRIES = 4;
const PAUSE_MS = 1500;

/** Return the name that a file gets: without its suffix. @param {string} file */
export function nameOf(file) {
  return file.replace(/\.(fcap|fovea)$/i, "");
}

/**
 * Send a file and return its recording; null when it was cancelled. Raise `RequestError` when it is refused.
 * @param {File} file
 * @param {{name: string, onProgress: (sent: number) => void, cancelled: AbortSignal}} how
 * @returns {Promise<RecordingDocument | null>}
 */
export async function sendRecording(file, { name, onProgress, cancelled }) {
  const body = { name, size_bytes: file.size };
  let upload = /** @type {UploadDocument} */ (await request("POST", "/recordings/uploads", { body }));
  const forget = () => request("DELETE", `/recordings/uploads/${upload.id}`).catch(() => {}); // the server may have
  while (!upload.recording) {
    onProgress(upload.received_bytes);
    if (cancelled.aborted) {
      await forget();
      return null;
    }
    try {
      upload = await sendPart(file, upload);
    } catch (error) {
      await forget();
      throw error;
    }
  }
  return upload.recording;
}

/** @param {File} file @param {UploadDocument} upload @returns {Promise<UploadDocument>} */
async function sendPart(file, upload) {
  const path = `/recordings/uploads/${upload.id}`;
  for (let tried = 1; ; tried += 1) {
    const at = upload.received_bytes;
    try {
      const body = file.slice(at, at + upload.part_bytes);
      return await request("PUT", `${path}?at=${at}`, { body, patience_ms: PART_MS });
    } catch (error) {
      if (!(error instanceof RequestError) || error.slug !== "offline" || tried === TRIES) throw error;
      await new Promise((resolve) => setTimeout(resolve, tried * PAUSE_MS));
      upload = await request("GET", path).catch(() => upload); // how far it has come
    }
  }
}
