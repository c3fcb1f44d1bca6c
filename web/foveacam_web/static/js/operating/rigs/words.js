// Texts of the page of all rigs about each rig. Pure functions.

/** @import { RigEntry } from "#api" */

/** @type {Record<string, string>} */
const STATES = { ready: "Ready", opening: "Opening", degraded: "Degraded", stopped: "Stopped" };

/** Return the badge of a rig: its tone and its word. @param {RigEntry} rig @returns {["good" | "warn" | "bad", string]} */
export function stateOf({ state }) {
  if (state === null) return ["bad", "No answer"];
  return [state === "ready" ? "good" : "warn", STATES[state] ?? state];
}

/** Return what kind of rig it is, and how it came to the list. @param {RigEntry} rig */
export function kindOf({ source, simulated, scene, rig_id }) {
  const kind =
    simulated === null ? null : simulated ? `simulated${scene === null ? "" : `, scene ${scene}`}` : "hardware";
  const from = { this: "this server", file: "named in the list", announced: "announces itself" }[source];
  return [rig_id, kind, from].filter((part) => part !== null).join(" · ");
}

/** Return who drives a rig that answers; "" of one that does not. @param {RigEntry} rig */
export function driverOf({ state, driver }) {
  if (state === null) return "";
  return driver === null ? "Control is free." : `${driver} drives it.`;
}

/** Return a picture's address that is another one at each time it is read. @param {RigEntry} rig @param {number} round */
export function pictureOf({ picture_url }, round) {
  return `${picture_url}${picture_url.includes("?") ? "&" : "?"}round=${round}`;
}
