// The state of measuring, and which measurements are shown. Pure functions.

/** @import { MeasureState } from "#page" */

/** @type {Readonly<MeasureState>} */
export const MEASURE_STATE = Object.freeze({
  measurements: null,
  hidden_measurements: [],
  selected_measurement: null,
  measuring: null,
});

/**
 * Return the visible measurements, newest first.
 * @param {Pick<MeasureState, "measurements" | "hidden_measurements">} state
 */
export function shownOf({ measurements, hidden_measurements }) {
  return (measurements ?? []).filter(({ id }) => !hidden_measurements.includes(id));
}
