// Connects the player of a recording with the windows that show its panes: they share its clock and pass on its keys.

/**
 * @import { Now } from "./panes.js"
 * @typedef {{key: string, shift: boolean}} PressedKey
 * @typedef {{kind: "now", now: Now} | {kind: "hello"} | {kind: "key", pressed: PressedKey}} LinkMessage
 */

const ALIVE_MS = 1000;
const GONE_MS = 3500;

/** @param {string} id */
function channelOf(id) {
  return new BroadcastChannel(`foveacam-replay-${id}`);
}

/**
 * Send the player's state to the windows of a recording, until the signal is aborted.
 * @param {string} id
 * @param {{now: () => Now, press: (pressed: PressedKey) => void, signal: AbortSignal}} options
 */
export function leadWindows(id, { now, press, signal }) {
  const channel = channelOf(id);
  const sendState = () => channel.postMessage({ kind: "now", now: now() });
  channel.addEventListener("message", ({ data }) => {
    if (data.kind === "hello") sendState();
    if (data.kind === "key") press(data.pressed);
  });
  const timer = setInterval(sendState, ALIVE_MS); // so that a window knows that the player is there
  signal.addEventListener("abort", () => {
    clearInterval(timer);
    channel.close();
  });
  return sendState;
}

/**
 * Follow the player of a recording.
 * @param {string} id
 * @param {{show: (now: Now) => void, lost: (gone: boolean) => void}} acts `lost`: whether the player is gone
 */
export function followPlayer(id, { show, lost }) {
  const channel = channelOf(id);
  let message_ms = performance.now();
  channel.addEventListener("message", ({ data }) => {
    if (data.kind !== "now") return;
    message_ms = performance.now();
    lost(false);
    show(data.now);
  });
  setInterval(() => lost(performance.now() - message_ms > GONE_MS), ALIVE_MS);
  channel.postMessage({ kind: "hello" });
  return { press: (/** @type {PressedKey} */ pressed) => channel.postMessage({ kind: "key", pressed }) };
}
