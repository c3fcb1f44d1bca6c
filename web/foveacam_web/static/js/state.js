// Composes the state of the console: what all pages share, and what each page holds of its own.

import { CALIBRATION_STATE } from "./calibration/state.js";
import { CAPTURE_STATE } from "./capture/state.js";
import { FOLLOW_STATE } from "./follow/state.js";
import { LOOP_STATE } from "./loop/state.js";
import { MEASURE_STATE } from "./measure/state.js";
import { PREFERENCES_STATE } from "./preferences/state.js";
import { RIG_STATE } from "./rig/state.js";
import { SETUP_STATE } from "./setup/state.js";
import { loadSettings } from "./settings.js";
import { STEER_STATE } from "./steer/state.js";
import { Store } from "./store.js";

/** @import { SharedState } from "#page" */

/** Return a store with the state before the first answer of the server. */
export function createStore() {
  return new Store({
    ...sharedState(),
    ...CALIBRATION_STATE,
    ...RIG_STATE,
    ...SETUP_STATE,
    ...PREFERENCES_STATE,
    ...CAPTURE_STATE,
    ...MEASURE_STATE,
    ...FOLLOW_STATE,
    ...LOOP_STATE,
    ...STEER_STATE,
    gallery: null,
    planner_page: false,
    compare_page: false,
    engine_page: false,
    rigs_page: false,
    people: null,
  });
}

/** @returns {SharedState} */
function sharedState() {
  return {
    stream: "connecting",
    events_link: "connecting",
    boot_id: null,
    sign_in: null,
    signed_out: false,
    rig: null,
    intrinsics: null,
    reach: null,
    views: [],
    shown: {},
    server_stats: {},
    overlay: null,
    current: null,
    targets: null,
    hidden_targets: [],
    selected_target: null,
    clouds: [],
    log: [],
    server_faults: [],
    page_faults: [],
    stop: null,
    lease: null,
    lease_asked: false,
    lease_token: sessionStorage.getItem("foveacam.lease"),
    steer_distance_m: null,
    recording: null,
    settings: loadSettings(),
  };
}
