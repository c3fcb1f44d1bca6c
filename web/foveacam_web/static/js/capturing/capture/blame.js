// Assigns each refusal of the server to a field of the capture page, and words it for the operator. Pure functions.

/**
 * @import { Problem } from "#api"
 * @import { Trouble } from "#page"
 */

/** @type {[RegExp, string][]} the first that matches gives the field */
const PLACES = [
  [/^name\b|there is a capture .* already/s, "name"],
  [/^label\b/, "label"],
  [/^licence\b/, "licence"],
  [/set points, line|^set points:|^plan\.points\.set_points/, "text"],
  [/^plan\.points\.grid\.(columns|rows)\b/, "size"],
  [/^plan\.points\.grid\.centre/, "centre"],
  [/^plan\.points\.grid/, "field"],
  [/^plan\.verging|^distance_m\b|average distance/, "distance"],
  [/^plan\.exposures_ms|an exposure of/, "exposures"],
  [/^plan\.stack/, "stack"],
  [/^plan\.rail|(on|of) the rail/, "rail"],
  [/^plan is |scans of \d+ points/, "size"],
  [/beyond its calibrated field|are beyond reach|more volts than were calibrated|the grid may be/, "reach"],
];
const ANOTHER = /(?<=\.) (?=(?:plan|name|label|licence|codec|distance_m)[\w.]* is )/;
const ASKED = /^[\w.]+ is (.+); needed is (.+)$/s;
const OF_A_KIND = /^(a|an|one|text|true) /;

/**
 * Split a refusal into its reasons, each with its field on the page.
 * @param {Problem} problem
 * @param {"grid" | "set_points"} source where the points come from
 * @returns {Trouble[]}
 */
export function blamed({ detail }, source) {
  return detail.split(ANOTHER).map((words) => {
    const found = PLACES.find(([pattern]) => pattern.test(words))?.[1] ?? null;
    return { place: found === "reach" ? (source === "grid" ? "field" : "text") : found, words: plainly(words) };
  });
}

/** Drop the names that only programs use from a reason. @param {string} words */
function plainly(words) {
  const [, given, needed] = ASKED.exec(words) ?? [];
  const message =
    !given || !needed ? words : OF_A_KIND.test(needed) ? `${given} was given; needed is ${needed}` : needed;
  return message.replace(/^(raster plan|set points)[:,] /, "");
}
