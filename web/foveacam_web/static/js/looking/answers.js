// Words a fixation's answer: its basis, its distance or limits. The card, the list, the marks and the messages use
// these texts.

import { distanceText, ENDS, MISSING, number } from "../elements/format.js";

/**
 * @import { AlternativeDocument, BoundDocument, EyeViewDocument, FixationDocument, FixationEstimate } from "#api"
 * @import { Basis } from "#page"
 * @typedef {{distance_m: number | null, distance_sigma_m: number | null, bound?: BoundDocument | null}} Answer
 * @typedef {{left_view?: EyeViewDocument | null, right_view?: EyeViewDocument | null}} Views
 */

/** @type {Readonly<Record<Basis, {words: string, title: string, meaning: string}>>} */
const BASES = Object.freeze({
  both_foveae: {
    words: "both foveae",
    title: "Measured by both foveae",
    meaning: "Left against right, confirmed by the wide view.",
  },
  fovea_and_wide: {
    words: "one fovea and wide camera",
    title: "Measured by one fovea and the wide camera",
    meaning: "Left and right cannot be matched with each other there. Half the baseline: a larger ±.",
  },
  surroundings: {
    words: "from its surroundings",
    title: "Inferred from its surroundings",
    meaning: "Nothing on it can be matched: interpolated by a surface through the depth measured around it.",
  },
  bound: { words: "limits only", title: "Limits only", meaning: "The distance itself could not be measured." },
});

/**
 * Return the basis of a fixation. Fixations stored by an earlier version have none; those that verged were measured by
 * both foveae.
 * @param {FixationDocument} fixation
 * @returns {Basis | null}
 */
export function basisOf(fixation) {
  const chosen = chosenOf(fixation);
  if (chosen) return chosen.basis;
  return fixation.basis ?? (fixation.state === "verged" ? "both_foveae" : null);
}

/**
 * Return the alternative that the operator chose, if any.
 * @param {FixationDocument} fixation
 * @returns {AlternativeDocument | null}
 */
export function chosenOf({ alternatives, chosen_alternative }) {
  return alternatives?.[chosen_alternative ?? -1] ?? null;
}

/**
 * Return the distance of a fixation: the alternative that the operator chose, else the measured one.
 * @param {FixationDocument} fixation
 * @returns {Answer}
 */
export function answerOf(fixation) {
  return chosenOf(fixation) ?? fixation;
}

/**
 * Name the basis of a distance in a few words.
 * @param {Basis | null | undefined} basis
 * @param {Views} [views] which eye saw it
 */
export function basisWords(basis, views = {}) {
  if (!basis) return "";
  const eye = basis === "fovea_and_wide" ? seeingEyes(views) : null;
  return eye ? `${eye} fovea and wide camera` : BASES[basis].words;
}

/**
 * Name the basis in a narrow column.
 * @param {Basis | null | undefined} basis
 * @param {Views} views
 */
export function basisShort(basis, views) {
  if (basis !== "fovea_and_wide") return basisWords(basis);
  return `${seeingEyes(views) ?? "one"} fovea`;
}

/** @param {Basis} basis */
export function basisMeaning(basis) {
  return BASES[basis].meaning;
}

/** An error of more than this share of the distance is worth a warning. */
const UNCERTAIN = 0.1;

/**
 * Return the title over the distance, its tone, and a hint when nothing was measured.
 * @param {FixationDocument} fixation
 * @returns {{title: string, tone: "good" | "plain" | "warn" | "bad", hint: string}}
 */
export function heading(fixation) {
  const basis = basisOf(fixation);
  if (!basis) return ENDS[fixation.state];
  const eye = basis === "fovea_and_wide" ? seeingEyes(fixation) : null;
  const by = eye === "each" ? "each fovea" : `the ${eye} fovea`;
  const title = eye ? `Measured by ${by} and the wide camera` : BASES[basis].title;
  const { distance_m, distance_sigma_m } = answerOf(fixation);
  if (distance_m !== null && (distance_sigma_m ?? 0) > UNCERTAIN * distance_m)
    return { title, tone: "warn", hint: "The distance is uncertain: look again, or at a place with more texture." };
  return { title, tone: basis === "bound" || basis === "surroundings" ? "plain" : "good", hint: "" };
}

/** Word the limits of a distance as a sentence without its full stop. @param {BoundDocument} bound */
export function boundText({ nearest_m, farthest_m }) {
  const nearest = `farther than ${number(nearest_m, 1)} m`;
  return farthest_m === null ? nearest : `${nearest}, nearer than ${number(farthest_m, 1)} m`;
}

/** Word the limits of a distance for a narrow place. @param {BoundDocument} bound */
export function boundShort({ nearest_m, farthest_m }) {
  return farthest_m === null ? `> ${number(nearest_m, 1)} m` : `${number(nearest_m, 1)} … ${number(farthest_m, 1)} m`;
}

/** Word the distance and its error, or the limits, in one short line. @param {Answer} answer */
export function answerText(answer) {
  if (answer.distance_m !== null) return distanceText(answer.distance_m, answer.distance_sigma_m);
  return answer.bound ? boundShort(answer.bound) : MISSING;
}

/** Word the result of a fixation for a screen reader. @param {FixationDocument} fixation */
export function spoken(fixation) {
  const answer = answerOf(fixation);
  const known = answer.distance_m === null && answer.bound ? boundText(answer.bound) : answerText(answer);
  const several =
    fixation.alternatives?.length && !chosenOf(fixation)
      ? ` ${fixation.alternatives.length} distances are possible.`
      : "";
  return `${heading(fixation).title}. ${known}.${several}`;
}

/** Word what is known of a running fixation's distance in one short line; empty while nothing is. @param {FixationEstimate | null | undefined} estimate */
export function estimateText(estimate) {
  return estimate?.distance_m == null ? "" : `≈ ${distanceText(estimate.distance_m, estimate.distance_sigma_m)}`;
}

/** Word the same for a screen reader. @param {FixationEstimate} estimate */
export function spokenEstimate({ distance_m, distance_sigma_m }) {
  return distance_m == null ? "" : `About ${distanceText(distance_m, distance_sigma_m)} so far. Looking.`;
}

/** @param {number} probability */
export function percent(probability) {
  return `${number(100 * probability, probability > 0.995 || probability < 0.01 ? 1 : 0)} %`;
}

/** Return which eyes see the target, each against the wide camera; null where that is not known. @param {Views} views */
function seeingEyes({ left_view, right_view }) {
  if (left_view?.sees_target && right_view?.sees_target) return "each";
  if (left_view?.sees_target) return "left";
  return right_view?.sees_target ? "right" : null;
}
