// Holds the page's state and notifies listeners by key, once a turn however many changes there were. Keeps the
// settings.

/** @import { ConsoleState, Settings } from "#page" */

const SETTINGS_KEY = "foveacam.settings";

/** @type {Readonly<Settings>} */
const DEFAULT_SETTINGS = Object.freeze({
  theme: "system",
  wide_size: "auto",
  fovea_size: "auto",
  footprints: true,
  field: true,
  marks: true,
  readout: true,
  scene: true,
  single_keys: true,
  hints: true,
});

/** State with listeners by key. */
export class Store {
  /** @type {ConsoleState} */
  #state;
  /** @type {{keys: Set<keyof ConsoleState>, listener: (state: ConsoleState) => void}[]} */
  #listeners = [];
  /** @type {Set<keyof ConsoleState>} */
  #changed = new Set();

  /** @param {ConsoleState} state */
  constructor(state) {
    this.#state = state;
  }

  get state() {
    return this.#state;
  }

  /** @param {Partial<ConsoleState>} part */
  set(part) {
    this.#state = { ...this.#state, ...part };
    if (this.#changed.size === 0) queueMicrotask(() => this.#tell());
    for (const key of /** @type {(keyof ConsoleState)[]} */ (Object.keys(part))) this.#changed.add(key);
  }

  /**
   * Call the listener now and whenever one of the keys changes, until the signal is aborted, if there is one.
   * @param {(keyof ConsoleState)[]} keys
   * @param {(state: ConsoleState) => void} listener
   * @param {AbortSignal} [signal]
   */
  on(keys, listener, signal) {
    const entry = { keys: new Set(keys), listener };
    this.#listeners.push(entry);
    signal?.addEventListener("abort", () => (this.#listeners = this.#listeners.filter((each) => each !== entry)));
    listener(this.#state);
  }

  /**
   * Resolve with the state once it satisfies the test.
   * @param {(keyof ConsoleState)[]} keys
   * @param {(state: ConsoleState) => boolean} test
   * @returns {Promise<ConsoleState>}
   */
  until(keys, test) {
    return new Promise((resolve) => {
      /** @param {ConsoleState} state */
      const listener = (state) => {
        if (!test(state)) return;
        this.#listeners = this.#listeners.filter((entry) => entry.listener !== listener);
        resolve(state);
      };
      this.on(keys, listener);
    });
  }

  #tell() {
    const changed = this.#changed;
    this.#changed = new Set();
    for (const entry of [...this.#listeners]) {
      const listens = this.#listeners.includes(entry); // an earlier listener may have removed it
      if (listens && [...entry.keys].some((key) => changed.has(key))) entry.listener(this.#state);
    }
  }
}

/**
 * Return a store with the state before the first answer of the server.
 * @returns {Store}
 */
export function createStore() {
  return new Store({
    stream: "connecting",
    events_link: "connecting",
    boot_id: null,
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
    stop: null,
    lease: null,
    lease_token: sessionStorage.getItem("foveacam.lease"),
    steer_distance_m: null,
    settings: loadSettings(),
    measurements: null,
    hidden_measurements: [],
    selected_measurement: null,
    measuring: null,
    wizard: null,
    records: null,
    health: null,
    sessions: null,
    session: null,
    pan_tilt: null,
    drift_checks: null,
    settle_time: null,
    work: null,
    rig_page: false,
    rail: null,
    trigger_test: null,
    faults: null,
    running_test: null,
    recording: null,
    gallery: null,
    capture_page: false,
    planner_page: false,
    captures: null,
    capturing: null,
    estimate: { stale: false, document: null, problem: null },
  });
}

/** @returns {Settings} */
function loadSettings() {
  try {
    const kept = JSON.parse(localStorage.getItem(SETTINGS_KEY) ?? "{}");
    return { ...DEFAULT_SETTINGS, ...kept };
  } catch {
    return { ...DEFAULT_SETTINGS }; // private mode or a damaged entry: use the defaults
  }
}

/**
 * Change settings and remember them in this browser.
 * @param {Store} store
 * @param {Partial<Settings>} part
 */
export function changeSettings(store, part) {
  const settings = { ...store.state.settings, ...part };
  store.set({ settings });
  try {
    localStorage.setItem(SETTINGS_KEY, JSON.stringify(settings));
  } catch {
    // private mode: the change lasts until the page closes
  }
}
