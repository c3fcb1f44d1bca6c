// The state of steering by hand.

/** @type {Readonly<import("#page").SteerState>} */
export const STEER_STATE = Object.freeze({
  steering: null,
  steer_limits: null,
  steer_refusal: "",
  steer_split: false,
  steer_shift_deg: 0,
  gamepad: null,
});
