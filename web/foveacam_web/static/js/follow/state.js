// The state of following before the first answer of the server.

/** @import { FollowState } from "#page" */

/** @type {Readonly<FollowState>} */
export const FOLLOW_STATE = Object.freeze({
  follow_page: false,
  follow_tab: false,
  click_follows: false,
  followed: null,
  follow_asked: {},
  trails: {},
});
