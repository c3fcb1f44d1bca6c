// The state of the vergence loop before the first answer of the server.

/** @import { LoopState } from "#page" */

/** @type {Readonly<LoopState>} */
export const LOOP_STATE = Object.freeze({
  loop_page: false,
  loop: null,
  loop_samples: [],
  loop_tuning: null,
  tune_refusal: "",
});
