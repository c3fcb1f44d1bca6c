// Finds entries of the command palette by parts of their words. Pure functions.

/**
 * Return how well words match what was typed: null where one of the typed parts is missing, else the sum of their positions.
 * @param {string} typed
 * @param {string} words
 */
function fitOf(typed, words) {
  const text = words.toLowerCase();
  const places = typed
    .toLowerCase()
    .split(/\s+/)
    .filter(Boolean)
    .map((part) => text.indexOf(part));
  return places.includes(-1) ? null : places.reduce((sum, place) => sum + place, 0);
}

/**
 * Return the entries that fit, the best first; a name counts before a hint.
 * @template {{label: string, hint?: string}} E
 * @param {string} typed
 * @param {E[]} entries
 */
export function fitting(typed, entries) {
  return entries
    .map((entry) => ({ entry, fit: fitOf(typed, `${entry.label} ${entry.hint ?? ""}`) }))
    .filter(({ fit }) => fit !== null)
    .sort((a, b) => Number(a.fit) - Number(b.fit))
    .map(({ entry }) => entry);
}
