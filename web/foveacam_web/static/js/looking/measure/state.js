// The state of measuring, and which measurements are shown. Pure functions.

/**
 * @import { MeasurementDocument, MirrorsDocument } from "#api"
 * @import { ConsoleState, MeasuredView, MeasureState } from "#page"
 */

const SAME_GAZE_V = 0.1;

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

/** Return the measurements that a view can show now. @param {ConsoleState} state @param {MeasuredView} view */
export function visibleIn(state, view) {
  if (!state.settings.marks) return [];
  const look = state.clouds[0]?.fixation_id;
  return shownOf(state).filter(({ fixation_ids, drawn_px, gaze }) => {
    if (!drawn_px[view]?.length) return false;
    if (view === "wide") return true;
    // every view of the foveae is made of their newest frames, also the anaglyph: it shows the look while they stay
    return fixation_ids.length === 1 && fixation_ids[0] === look && standsAt(state.rig?.mirrors, gaze);
  });
}

/** @param {MirrorsDocument | null | undefined} mirrors @param {MeasurementDocument["gaze"]} gaze */
function standsAt(mirrors, gaze) {
  if (!gaze || !mirrors?.left || !mirrors.right) return false;
  const off_v = [
    (mirrors.left.x_v ?? NaN) - gaze.left_v[0],
    (mirrors.left.y_v ?? NaN) - gaze.left_v[1],
    (mirrors.right.x_v ?? NaN) - gaze.right_v[0],
    (mirrors.right.y_v ?? NaN) - gaze.right_v[1],
  ];
  return off_v.every((off) => Math.abs(off) < SAME_GAZE_V);
}
