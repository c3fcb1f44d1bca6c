// Reads the binary messages of the view socket. Used by the page and its worker.

import { API } from "../root.js";

export const HEADER_BYTES = 24;
const FROZEN = 1;

/**
 * @typedef {{view: number, scale: number, frozen: boolean, seq: number, t_capture_us: bigint, age_us: number, binning: number}} FrameHeader
 *   `binning`: of the camera's picture, before it was made smaller by `scale`
 */

/**
 * Read the header of one binary message (little-endian; a JPEG follows it).
 * @param {ArrayBuffer} message
 * @returns {FrameHeader}
 */
export function readHeader(message) {
  if (message.byteLength <= HEADER_BYTES) {
    throw new RangeError(`a frame of ${message.byteLength} bytes is shorter than its header of ${HEADER_BYTES}`);
  }
  const bytes = new DataView(message, 0, HEADER_BYTES);
  return {
    view: bytes.getUint8(0),
    scale: bytes.getUint8(1),
    frozen: (bytes.getUint16(2, true) & FROZEN) !== 0,
    seq: bytes.getUint32(4, true),
    t_capture_us: bytes.getBigUint64(8, true),
    age_us: bytes.getUint32(16, true),
    binning: bytes.getUint8(20),
  };
}

/** @param {ArrayBuffer} message */
export function jpegOf(message) {
  return new Blob([new Uint8Array(message, HEADER_BYTES)], { type: "image/jpeg" });
}

/** Return the address of the view socket of a page. @param {string} page_url */
export function socketUrl(page_url) {
  const url = new URL(`${API}/views/ws`, page_url);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return url.href;
}
