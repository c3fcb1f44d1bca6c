// The state of the set-up page before the first answer of the server.

/** @type {Readonly<import("#page").SetupState>} */
export const SETUP_STATE = Object.freeze({
  setup_page: false,
  setup: null,
  setup_problem: "",
  setup_file: null,
  setup_files: null,
  found: null,
  searching: false,
  advice: null,
  tries: {},
  start: null,
  start_dismissed: false,
});
