// The state of the settings page before the first answer of the server.

/** @type {Readonly<import("#page").PreferencesState>} */
export const PREFERENCES_STATE = Object.freeze({
  settings_page: false,
  camera_presets: null,
  window_layouts: null,
});
