// Composes the state of the console: what all pages share, and what each page holds of its own.

import { CALIBRATION_STATE } from "./calibrating/calibration/state.js";
import { CAPTURE_STATE } from "./capturing/capture/state.js";
import { MEASURE_STATE } from "./looking/measure/state.js";
import { loadSettings } from "./settings.js";
import { Store } from "./store.js";

/**
 * @import { FollowState, LoopState, PreferencesState, RigPageState, SetupState, SharedState, SteerState } from "#page"
 */

/** @type {Readonly<FollowState>} */
const FOLLOW_STATE = Object.freeze({
  follow_page: false,
  follow_tab: false,
  click_follows: false,
  followed: null,
  follow_asked: {},
  trails: {},
});

/** @type {Readonly<LoopState>} */
const LOOP_STATE = Object.freeze({
  loop_page: false,
  loop: null,
  loop_samples: [],
  loop_tuning: null,
  tune_refusal: "",
});

/** @type {Readonly<PreferencesState>} */
const PREFERENCES_STATE = Object.freeze({
  settings_page: false,
  camera_presets: null,
  window_layouts: null,
});

/** @type {Readonly<RigPageState>} */
const RIG_STATE = Object.freeze({
  rig_page: null,
  rail: null,
  trigger_test: null,
  faults: null,
  running_test: null,
});

/** @type {Readonly<SetupState>} */
const SETUP_STATE = Object.freeze({
  setup_page: false,
  setup: null,
  setup_problem: "",
  setup_file: null,
  setup_files: null,
  setup_begun_simulated: null,
  found: null,
  searching: false,
  advice: null,
  tries: {},
  start: null,
  start_dismissed: false,
});

/** @type {Readonly<SteerState>} */
const STEER_STATE = Object.freeze({
  steering: null,
  steer_limits: null,
  steer_refusal: "",
  steer_split: false,
  steer_shift_deg: 0,
  gamepad: null,
});

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
    eyes_stay: true,
    full_look: null,
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
    hints_asked: false,
    settings: loadSettings(),
  };
}
