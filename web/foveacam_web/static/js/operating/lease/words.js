// Words for the control lease: who holds it, what this person may do about it. Pure functions.

/**
 * @import { LeaseDocument } from "#api"
 * @import { SignInDocument } from "#api"
 * @typedef {{lease: LeaseDocument | null, mine: boolean, sign_in: SignInDocument | null, asked: boolean}} LeaseState
 *   `asked`: whether this page asks the holder for it
 */

/** Holder's name on a server without sign-in. */
export const NAMELESS = "operator";
/** @type {Readonly<LeaseDocument>} */
export const NO_LEASE = Object.freeze({ holder: null, expires_in_s: null, person: null, idle_s: null, asked_by: null });
const IDLE_WORTH_SAYING_S = 60;

/** Return whether people sign in, so that no name has to be typed. @param {SignInDocument | null} sign_in @returns {sign_in is SignInDocument} */
export function isPerson(sign_in) {
  return sign_in?.mode === "users";
}

/** Return what this page calls itself to others: the person's name where people sign in. @param {SignInDocument | null} sign_in */
export function holderName(sign_in) {
  return isPerson(sign_in) ? (sign_in.name ?? NAMELESS) : NAMELESS;
}

/** @param {LeaseState} state */
export function leaseWords({ lease, mine, asked }) {
  if (mine) return "You have control: others can look, and stop, but not move the mirrors.";
  if (!lease?.holder) return "Nobody has control: everybody may move the mirrors. Take it for exclusive use.";
  const idle_s = lease.idle_s ?? 0;
  const idle =
    idle_s < IDLE_WORTH_SAYING_S ? "" : ` Nothing was moved for ${Math.floor(idle_s / IDLE_WORTH_SAYING_S)} min.`;
  const waiting = asked ? " You asked for it; it comes to you when it is handed over." : "";
  const taking = lease.person ? "" : " Taking it over is written into the event log.";
  return `${lease.holder} has control.${idle}${waiting}${taking}`;
}

/** Return the badge of the top bar. @param {LeaseDocument | null} lease @param {boolean} mine */
export function leaseBadge(lease, mine) {
  if (!mine) return lease?.holder ? `${lease.holder} has control` : "Control is free";
  return lease?.asked_by ? `${lease.asked_by} asks for control` : "You have control";
}

/**
 * Return which ways to control there are: `take` while it is free, `over` to take it over, `reason` whether that needs
 * one, `ask` to ask the holder, `give` it back, `answer` who asks.
 * @param {LeaseState} state
 */
export function leaseWays({ lease, mine, sign_in, asked }) {
  const held = Boolean(lease?.holder) && !mine;
  const person = lease?.person ?? null;
  const own = person !== null && person === sign_in?.name;
  const admin = sign_in?.rights.includes("administer") ?? true;
  return {
    take: !lease?.holder && !mine,
    over: held && (person === null || own || admin),
    reason: held && person !== null && !own,
    ask: held && person !== null && !own && !asked,
    give: mine,
    answer: mine && Boolean(lease?.asked_by),
  };
}
