// Formats followed targets: the words of a card, the marks of an overlay message, the trail's plot and file. Pure functions.

import { distanceText, MISSING, number, sentence, span } from "../../elements/format.js";
import { runsOf } from "../../elements/runs.js";

/**
 * @import { FollowedDocument, TrailPoint } from "#api"
 * @import { ConsoleState, FollowEnded, FollowMark, Point } from "#page"
 * @import { BandPoint } from "../../elements/plot.js"
 * @typedef {{kind: string, x: number, y: number, label: string, label_y: number}} RingMark CSS px
 */

export const RING_PX = 13;
const LABEL = Object.freeze({ width: 90, height: 14, above: -18, below: 26 });

/** @type {Readonly<Record<FollowedDocument["state"], {tone: string, text: string, detail: string}>>} */
export const STATES = Object.freeze({
  finding: { tone: "plain", text: "Finding", detail: "Both foveae verge on it first." },
  followed: { tone: "good", text: "Followed", detail: "" },
  lost: { tone: "warn", text: "Lost", detail: "It is searched for where it was seen last, and elsewhere." },
  out_of_field: {
    tone: "warn",
    text: "Out of the field",
    detail: "The mirrors cannot turn there; it is looked at again when it comes back.",
  },
});

/** @type {[FollowedDocument["tracker"], string][]} */
export const TRACKERS = [
  ["template", "Template"],
  ["filter", "Filter"],
];

/** @type {[number, string][]} */
const PRIORITIES = [
  [0.5, "½ ×"],
  [1, "1 ×"],
  [2, "2 ×"],
  [4, "4 ×"],
];

/**
 * Return the priorities to choose from, with the given one among them.
 * @param {number} now
 * @returns {[number, string][]}
 */
export function prioritiesWith(now) {
  if (PRIORITIES.some(([value]) => value === now)) return PRIORITIES;
  const all = [...PRIORITIES, /** @type {[number, string]} */ ([now, `${now} ×`])];
  return all.sort(([a], [b]) => a - b);
}

/** @param {FollowedDocument} followed */
export function distanceOf({ distance_m, distance_sigma_m }) {
  return distanceText(distance_m, distance_sigma_m);
}

/**
 * Return the name and value of each figure of a card.
 * @param {FollowedDocument} followed
 * @returns {[string, string][]}
 */
export function figuresOf({ speed_m_s, rate_hz, age_s, hits, looks }) {
  return [
    ["Speed", speed_m_s === null ? MISSING : `${number(speed_m_s, 2)} m/s`],
    ["Rate", `${number(rate_hz, 1)} hits/s`],
    ["Last hit", age_s === null ? MISSING : `${span(age_s)} ago`],
    ["Hits", looks === 0 ? MISSING : `${hits} of ${looks}`],
  ];
}

/**
 * Return the message that targets are followed no more; null where the user requested that.
 * @param {FollowEnded[]} ended
 * @returns {{tone: "warn", title: string, detail: string} | null}
 */
export function endedMessage(ended) {
  if (ended.length === 0) return null;
  const names = ended.map(({ label }) => `“${label}”`).join(", ");
  const reasons = [...new Set(ended.map(({ reason }) => sentence(reason)))].join(" ");
  return { tone: "warn", title: `${names} ${ended.length > 1 ? "are" : "is"} followed no more`, detail: reasons };
}

/**
 * Return the marks of the followed targets: those of the overlay message, and those that the foveae have yet to find
 * where this page requested them.
 * @param {Pick<ConsoleState, "overlay" | "followed" | "follow_asked">} state
 * @returns {FollowMark[]}
 */
export function marksOf({ overlay, followed, follow_asked }) {
  const found = overlay?.follows ?? [];
  const sought = (followed ?? []).flatMap(({ id, label, state }) => {
    const at = state === "finding" && found.every((mark) => mark.id !== id) ? follow_asked[id] : undefined;
    return at ? [{ id, label, state, x_px: at.x, y_px: at.y }] : [];
  });
  return [...found, ...sought];
}

/**
 * Return the rings of the followed targets, each label above its ring, or below where another one is.
 * @param {FollowMark[]} marks
 * @param {(at: Point) => Point} toCss
 * @returns {RingMark[]}
 */
export function followRings(marks, toCss) {
  /** @type {Point[]} */
  const taken = [];
  return marks.map(({ state, label, x_px, y_px }) => {
    const { x, y } = toCss({ x: x_px, y: y_px });
    const free = (/** @type {number} */ at) =>
      taken.every((other) => Math.abs(other.x - x) > LABEL.width || Math.abs(other.y - at) > LABEL.height);
    const label_y = free(y + LABEL.above) ? y + LABEL.above : y + LABEL.below;
    taken.push({ x, y: label_y });
    return { kind: `follow ${state}`, x, y, label, label_y };
  });
}

/**
 * Return a trail's distances over the time before its last hit, split where the target was not seen for long.
 * @param {TrailPoint[]} trail
 * @returns {BandPoint[][]}
 */
export function trailRuns(trail) {
  const last_s = trail.at(-1)?.t_s ?? 0;
  return runsOf(trail.map((point) => ({ x: point.t_s - last_s, y: lengthOf(point), sigma: point.distance_sigma_m })));
}

/** Return a trail as the text of a CSV file. @param {TrailPoint[]} trail */
export function trailCsv(trail) {
  const rows = trail.map((point) =>
    [
      point.t_s.toFixed(4),
      ...[point.x_m, point.y_m, point.z_m, lengthOf(point), point.distance_sigma_m].map((each) => each.toFixed(5)),
    ].join(","),
  );
  return ["t_s,x_m,y_m,z_m,distance_m,distance_sigma_m", ...rows, ""].join("\n");
}

/** Return the name of a trail's file. @param {string} label */
export function trailFile(label) {
  const plain = label.replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "");
  return `trail-${plain || "target"}.csv`;
}

/** @param {TrailPoint} point */
function lengthOf({ x_m, y_m, z_m }) {
  return Math.hypot(x_m, y_m, z_m);
}
