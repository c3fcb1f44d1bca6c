// Texts of the table of data flow between the parts. Pure functions.

import { count, number, sentence } from "../../elements/format.js";
import { percent } from "./words.js";

/** @import { EdgeDocument, EngineDocument, PartDocument } from "#api" */

/** @type {Record<string, string>} */
const NAMES = {
  "event loop": "Event loop",
  requests: "Requests",
  encoder: "JPEG encoder",
  viewers: "Viewers",
  mirrors: "Mirrors",
  "recording file": "Recording file",
  "foveacam-hardware": "Hardware thread",
};

/** The order of the rows: by the kind of the part that gives. @type {PartDocument["kind"][]} */
const KINDS = ["camera", "thread", "device", "view", "clients", "file"];

/** @param {Pick<PartDocument, "name" | "kind">} part */
export function partName({ name, kind }) {
  const known = NAMES[name];
  if (known !== undefined) return known;
  const plain = name.replace(/^foveacam-|^view /, "").replaceAll(/[-_.]/g, " ");
  if (kind === "camera") return `Camera ${plain.replace(/^camera /, "")}`;
  return sentence(kind === "view" ? `view ${plain}` : plain).replace(/\.$/, "");
}

/** Return a part with what it does now. @param {PartDocument} part */
export function partWords(part) {
  const { busy_share, waiting, flagged } = part;
  const state = [
    busy_share !== null && `${percent(busy_share)} busy`,
    waiting && `${waiting} waiting`,
    flagged && "does not keep up",
  ];
  return [partName(part), ...state].filter(Boolean).join(", ");
}

/**
 * Return what goes from part to part as the rows of a table, in the direction of its flow.
 * @param {Pick<EngineDocument, "parts" | "edges">} engine
 * @returns {{flagged: boolean, idle: boolean, cells: string[]}[]}
 */
export function flowRows({ parts, edges }) {
  const partOf = (/** @type {string} */ name) => /** @type {PartDocument} */ (parts.find((part) => part.name === name));
  const rank = (/** @type {EdgeDocument} */ { source }) => KINDS.indexOf(partOf(source).kind);
  return [...edges]
    .sort((a, b) => rank(a) - rank(b))
    .map((edge) => ({
      flagged: edge.flagged,
      idle: edge.rate_hz === 0 && edge.dropped_hz === 0,
      cells: [partWords(partOf(edge.source)), partWords(partOf(edge.target)), ...figuresOf(edge)],
    }));
}

/** @param {EdgeDocument} edge */
function figuresOf({ items, rate_hz, mb_per_s, count: passed, dropped, dropped_hz }) {
  return [
    `${number(rate_hz, rate_hz < 10 ? 2 : 1)} ${items}/s`,
    mb_per_s === null ? "" : `${number(mb_per_s, mb_per_s < 10 ? 2 : 0)} MB/s`,
    count(passed),
    dropped === 0 ? "" : `${number(dropped_hz, 2)}/s, ${count(dropped)} in all`,
  ];
}
