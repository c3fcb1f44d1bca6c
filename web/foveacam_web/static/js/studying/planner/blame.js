// Assigns each refusal of the server to a field of the planner, and words it for the user. Pure functions.

import { NAMES, NUMBERS } from "./settings.js";

/**
 * @import { Problem } from "#api"
 * @import { PlanSettings, Trouble } from "#page"
 */

/** @type {[RegExp, string][]} the first that matches gives the field */
const PLACES = [
  [/^ring\.(\w+) is/, "$1"],
  [/^clutter\.(\w+) is/, "$1"],
  [/^(domain_m2|agent_radius_m) is/, "$1"],
  [/^a domain of/, "domain_m2"],
  [/are an angle of/, "pixels"],
  [/^D_min of/, "d_min_m"],
  [/^the depth error of/, "near_error_m"],
  [/^an agent of radius/, "agent_radius_m"],
  [/target/, "targets"],
];
const ANOTHER = /(?<=\.) (?=[\w.]+ is .*; needed is )/;
const ASKED = /^[\w.]+ is (.+); needed is (.+)$/s;

/**
 * Split a refusal into its reasons, each with its field on the page.
 * @param {Problem | null} problem
 * @returns {Trouble[]}
 */
export function blamed(problem) {
  if (!problem) return [];
  return problem.detail.split(ANOTHER).map((words) => {
    const [pattern, place] = PLACES.find(([each]) => each.test(words)) ?? [null, null];
    const found = pattern && place?.startsWith("$") ? (pattern.exec(words)?.[1] ?? null) : place;
    const [, given, needed] = ASKED.exec(words) ?? [];
    const message = given && needed ? `${given} was given; needed is ${needed}` : words;
    return {
      place: found,
      words: found === "domain_m2" ? `${message.replace(/\.$/, "")}; give more, or let it follow the ring` : message,
    };
  });
}

/** Return the fields that hold no number, as faults. @param {PlanSettings} settings @returns {Trouble[]} */
export function unfilled(settings) {
  return NAMES.filter((name) => !Number.isFinite(settings[name]) && (name !== "domain_m2" || settings.own_domain)).map(
    (name) => ({ place: name, words: `${NUMBERS[name].label} is empty: type in a number` }),
  );
}
