// Texts about the age of a lost source's last picture. Pure functions; the pane itself shows why it is lost.

import { span } from "../../elements/format.js";

/**
 * @import { ConsoleState, Role, ViewName } from "#page"
 */

const SILENT_MS = 2500;

/**
 * Return how old the picture of a view is while its source is lost, null while it is not or has shown none.
 * @param {Pick<ConsoleState, "stream" | "rig" | "shown" | "server_stats">} state
 * @param {ViewName} name
 * @param {{needs: Role[], live: boolean}} view `live`: a picture comes with each frame, not with each look
 */
export function lossWords({ stream, rig, shown, server_stats }, name, { needs, live }) {
  const view = shown[name];
  if (!view || view.count === 0) return null;
  const missing = rig?.cameras.some(({ role, connected }) => needs.includes(/** @type {Role} */ (role)) && !connected);
  const frozen = live && (view.silent_ms > SILENT_MS || server_stats[name]?.frozen_since_ms != null);
  if (stream === "open" && !missing && !frozen) return null;
  return `Last picture ${span(view.age_ms / 1000)} old`;
}

/**
 * Return how long the server is away, for the 3D view, which has no frames.
 * @param {number | null} since_ms null while it is there
 * @param {number} now_ms
 */
export function absenceWords(since_ms, now_ms) {
  return since_ms === null ? null : `No connection for ${span((now_ms - since_ms) / 1000)}`;
}
