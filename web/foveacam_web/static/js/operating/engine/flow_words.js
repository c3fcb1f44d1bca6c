// Texts of the graph of who feeds whom. Pure functions.

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

/** @type {Record<PartDocument["kind"], string>} */
const KINDS = {
  thread: "Thread",
  camera: "Camera",
  device: "Device",
  view: "View, the newest picture counts",
  clients: "Clients",
  file: "File",
};

/** @param {Pick<PartDocument, "name" | "kind">} part */
export function partName({ name, kind }) {
  const known = NAMES[name];
  if (known !== undefined) return known;
  const plain = name.replace(/^foveacam-|^view /, "").replaceAll(/[-_.]/g, " ");
  if (kind === "camera") return `Camera ${plain.replace(/^camera /, "")}`;
  return sentence(kind === "view" ? `view ${plain}` : plain).replace(/\.$/, "");
}

/** Format a rate so short that it stands beside its line; nothing when it is zero. @param {number} rate_hz */
export function shortRate(rate_hz) {
  return rate_hz === 0 ? "" : `${number(rate_hz, rate_hz < 0.1 ? 2 : rate_hz < 10 ? 1 : 0)}/s`;
}

/** @param {Pick<EdgeDocument, "rate_hz" | "dropped_hz">} edge */
export function edgeRate({ rate_hz, dropped_hz }) {
  return { passed: shortRate(rate_hz), lost: shortRate(dropped_hz) };
}

/** Return the second line of a part's box. @param {PartDocument} part @param {Pick<EngineDocument, "edges">} engine */
export function partState(part, { edges }) {
  if (part.busy_share !== null) {
    const waiting = part.waiting ? `, ${part.waiting} waiting` : "";
    return `${percent(part.busy_share)} busy${waiting}`;
  }
  const taken = edges.filter(({ target }) => target === part.name);
  const given = edges.filter(({ source }) => source === part.name);
  return flowOf(taken.length > 0 ? taken : given) || "at rest";
}

/** @param {EdgeDocument[]} edges */
function flowOf(edges) {
  const mb_per_s = edges.reduce((sum, edge) => sum + (edge.mb_per_s ?? 0), 0);
  const rate = shortRate(edges.reduce((sum, edge) => sum + edge.rate_hz, 0));
  return mb_per_s === 0 ? rate : `${rate}, ${number(mb_per_s, mb_per_s < 10 ? 1 : 0)} MB/s`;
}

/** Return a part in one sentence, for who does not see the graph. @param {PartDocument} part @param {Pick<EngineDocument, "parts" | "edges">} engine */
export function partWords(part, engine) {
  const [from, to] = [partners(part, engine, "target", "source"), partners(part, engine, "source", "target")];
  const told = [partName(part), partState(part, engine), from && `fed by ${from}`, to && `feeds ${to}`];
  return told.filter(Boolean).join(", ");
}

/**
 * @param {PartDocument} part @param {Pick<EngineDocument, "parts" | "edges">} engine
 * @param {"source" | "target"} own @param {"source" | "target"} other
 */
function partners(part, { parts, edges }, own, other) {
  const names = edges.filter((edge) => edge[own] === part.name).map((edge) => edge[other]);
  return [...new Set(names)].map((name) => nameOf(name, parts)).join(" and ");
}

/** @param {string} name @param {PartDocument[]} parts */
function nameOf(name, parts) {
  return partName(parts.find((part) => part.name === name) ?? { name, kind: "thread" });
}

/** Return the details of a part as rows. @param {PartDocument} part @param {EngineDocument} engine @returns {[string, string][]} */
export function partDetails(part, { parts, edges, hardware }) {
  /** @type {[string, string][]} */
  const rows = [["Kind", KINDS[part.kind]]];
  if (part.busy_share !== null) rows.push(["Busy", percent(part.busy_share)]);
  if (part.waiting !== null) rows.push(["Waiting", `${part.waiting} of ${hardware.queue_limit}`]);
  for (const edge of edges) {
    if (edge.target === part.name) rows.push([`From ${nameOf(edge.source, parts)}`, edgeWords(edge)]);
  }
  for (const edge of edges) {
    if (edge.source === part.name) rows.push([`To ${nameOf(edge.target, parts)}`, edgeWords(edge)]);
  }
  return rows;
}

/** @param {EdgeDocument} edge */
export function edgeWords({ items, rate_hz, mb_per_s, count: passed, dropped, dropped_hz }) {
  const now = `${number(rate_hz, rate_hz < 10 ? 2 : 1)} ${items}/s`;
  const size = mb_per_s === null ? "" : ` (${number(mb_per_s, mb_per_s < 10 ? 2 : 0)} MB/s)`;
  const lost = dropped === 0 ? "" : `, ${count(dropped)} dropped (${number(dropped_hz, 2)}/s)`;
  return `${now}${size}, ${count(passed)} in all${lost}`;
}
