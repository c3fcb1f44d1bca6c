// The state of the rig page.

/** @type {Readonly<import("#page").RigPageState>} */
export const RIG_STATE = Object.freeze({
  rig_page: false,
  rail: null,
  trigger_test: null,
  faults: null,
  running_test: null,
});
