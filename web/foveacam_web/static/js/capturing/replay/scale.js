// The part of a recording that its timeline shows: zoom about the pointer, pan with a rubber band, and the ruler's
// ticks. Pure functions.

/**
 * @typedef {{from_s: number, to_s: number}} Span
 * @typedef {{at_s: number, text: string}} Tick
 */

const LEAST_S = 0.005;
const RESISTANCE = 3;
const TICK_PX = 70;
const STEPS = [1, 2, 5];
const MINUTE_STEPS_S = [10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 43200, 86400];

/** Return the whole of a recording. @param {number} duration_s @returns {Span} */
export function wholeOf(duration_s) {
  return { from_s: 0, to_s: Math.max(duration_s, LEAST_S) };
}

/** Return a span moved into the recording, and not longer than it. @param {Span} span @param {number} duration_s @returns {Span} */
export function within({ from_s, to_s }, duration_s) {
  const whole = wholeOf(duration_s);
  const length_s = Math.min(Math.max(to_s - from_s, LEAST_S), whole.to_s);
  const begin_s = Math.min(Math.max(from_s, 0), whole.to_s - length_s);
  return { from_s: begin_s, to_s: begin_s + length_s };
}

/**
 * Return a span that shows less or more; the moment under the pointer stays where it is.
 * @param {Span} span
 * @param {number} factor above 1 to show less
 * @param {number} at_s
 * @param {number} duration_s
 * @returns {Span}
 */
export function zoomed({ from_s, to_s }, factor, at_s, duration_s) {
  const length_s = Math.min(Math.max((to_s - from_s) / factor, LEAST_S), wholeOf(duration_s).to_s);
  const share = (at_s - from_s) / (to_s - from_s);
  const begin_s = at_s - share * length_s;
  return within({ from_s: begin_s, to_s: begin_s + length_s }, duration_s);
}

/** Return a span that is moved. @param {Span} span @param {number} by_s @param {number} duration_s */
export function panned({ from_s, to_s }, by_s, duration_s) {
  return within({ from_s: from_s + by_s, to_s: to_s + by_s }, duration_s);
}

/** Return a span as it is dragged: beyond an end it follows the pointer less and less. @param {Span} span @param {number} by_s @param {number} duration_s @returns {Span} */
export function pulled({ from_s, to_s }, by_s, duration_s) {
  const free = { from_s: from_s + by_s, to_s: to_s + by_s };
  const held = within(free, duration_s);
  const beyond_s = (free.from_s - held.from_s) / RESISTANCE;
  return { from_s: held.from_s + beyond_s, to_s: held.to_s + beyond_s };
}

/** Return a span in which a moment is seen: the same while it is in it. @param {Span} span @param {number} at_s @param {number} duration_s */
export function following(span, at_s, duration_s) {
  if (at_s >= span.from_s && at_s <= span.to_s) return span;
  const length_s = span.to_s - span.from_s;
  return within({ from_s: at_s - length_s / 10, to_s: at_s + (9 * length_s) / 10 }, duration_s);
}

/** Return the ruler's ticks. @param {Span} span @param {number} width_px @returns {Tick[]} */
export function ticksOf({ from_s, to_s }, width_px) {
  const step_s = stepOf(((to_s - from_s) * TICK_PX) / Math.max(width_px, TICK_PX));
  const decimals = Math.max(0, Math.ceil(-Math.log10(step_s) - 1e-9));
  const found = [];
  for (let index = Math.ceil(from_s / step_s - 1e-9); index * step_s <= to_s + 1e-9; index += 1) {
    const at_s = index * step_s;
    if (at_s >= -1e-9) found.push({ at_s, text: tickWords(at_s, decimals) });
  }
  return found;
}

/** @param {number} least_s */
function stepOf(least_s) {
  if (least_s > 5) return MINUTE_STEPS_S.find((step_s) => step_s >= least_s) ?? 86_400;
  const decade = 10 ** Math.floor(Math.log10(least_s));
  const step = STEPS.find((one) => one * decade >= least_s * (1 - 1e-9));
  return step ? step * decade : 10 * decade;
}

/** @param {number} at_s @param {number} decimals */
function tickWords(at_s, decimals) {
  const rounded = Number(at_s.toFixed(decimals));
  const minutes = Math.floor(rounded / 60);
  const rest = (rounded - 60 * minutes).toFixed(decimals).padStart(decimals > 0 ? decimals + 3 : 2, "0");
  if (minutes < 60) return `${minutes}:${rest}`;
  return `${Math.floor(minutes / 60)}:${String(minutes % 60).padStart(2, "0")}:${rest}`;
}
