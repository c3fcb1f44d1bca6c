// The settings of this browser: loads them, and changes and saves them.

/**
 * @import { Settings, Store } from "#console"
 */

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
  record: Object.freeze({ prefix: "recording", rate: "full", compress: false, packed: false }),
});

/** @returns {Settings} */
export function loadSettings() {
  try {
    const kept = JSON.parse(localStorage.getItem(SETTINGS_KEY) ?? "{}");
    return { ...DEFAULT_SETTINGS, ...kept, record: { ...DEFAULT_SETTINGS.record, ...kept.record } };
  } catch {
    return { ...DEFAULT_SETTINGS }; // private mode or a damaged entry: use the defaults
  }
}

/** Change settings and remember them in this browser. @param {Store} store @param {Partial<Settings>} part */
export function changeSettings(store, part) {
  const settings = { ...store.state.settings, ...part };
  store.set({ settings });
  try {
    localStorage.setItem(SETTINGS_KEY, JSON.stringify(settings));
  } catch {
    // private mode: the change lasts until the page closes
  }
}
