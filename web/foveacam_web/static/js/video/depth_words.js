// Texts about the backend that computes the depth of looks, and why one cannot.

/** @import { DepthBackendDocument, DepthBackendsDocument } from "#api" */

const BUILT_IN = "sgbm";
/** @type {Readonly<Record<string, string>>} */
const BUILT_IN_WORDS = Object.freeze({ sgbm: "Semi-global matching", live: "The same, faster and coarser" });

/** Return the words of a backend in the list. @param {DepthBackendDocument} backend */
export function backendWords({ kind, name, licence, problem, research_only }) {
  if (kind === "built_in") return BUILT_IN_WORDS[name] ?? name;
  if (problem) return `${name} (cannot be used)`;
  return research_only ? `${name} (research only, ${licence})` : `${name} (${licence})`;
}

/** Return the title of the list of backends. @param {DepthBackendsDocument} found */
export function choiceWords({ fallback, in_use }) {
  return fallback
    ? `The last look was computed by ${BUILT_IN} instead of ${in_use}: ${fallback}`
    : "What computes the depth of a look, from the next one on, of this view and of new mosaics; for all viewers";
}

/** Return what computed a result. @param {string} backend @param {string | null} sha256 of a network's graph */
export function computedBy(backend, sha256) {
  return sha256 === null ? (BUILT_IN_WORDS[backend] ?? backend) : `${backend}, SHA-256 ${sha256.slice(0, 12)}…`;
}
