// Words for people, their roles and their passwords. Pure functions.

/**
 * @import { PersonRole, Right } from "#page"
 * @import { SignInDocument } from "#api"
 * @typedef {{name: string, does: string}} RoleWords
 */

const LEAST_CHARACTERS = 10;

/** @type {Readonly<Record<PersonRole, RoleWords>>} */
export const ROLES = Object.freeze({
  viewer: { name: "Viewer", does: "sees everything and moves nothing" },
  operator: {
    name: "Operator",
    does: "sees everything, moves the rig, captures, and changes or trashes what was made",
  },
  admin: {
    name: "Admin",
    does: "does what an operator does, sets the rig up, puts calibrations in force, deletes for good, and manages users",
  },
});

/** Sentence for a user with the role viewer. */
export const VIEWER_WORDS = "You are signed in as a viewer: you see everything and move nothing.";

/** Return whether to show who is signed in: not on an open server. @param {SignInDocument | null} sign_in @returns {sign_in is SignInDocument} */
export function isNamed(sign_in) {
  return sign_in !== null && sign_in.mode !== "open";
}

/** Return whether the user has this right. @param {SignInDocument | null} sign_in @param {Right} right */
export function may(sign_in, right) {
  return sign_in?.rights.includes(right) ?? false;
}

/** Return whether to offer what needs this right; true also while the sign-in is not yet known. @param {SignInDocument | null} sign_in @param {Right} right */
export function offers(sign_in, right) {
  return sign_in === null || may(sign_in, right);
}

/** @param {SignInDocument} sign_in */
export function whoWords({ name, kind }) {
  return kind === "shared_token" ? "Shared token" : (name ?? "This machine");
}

/** @param {SignInDocument} sign_in @returns {RoleWords} */
export function roleWords({ role, rights }) {
  if (role) return ROLES[role];
  return ROLES[rights.includes("administer") ? "admin" : rights.includes("operate") ? "operator" : "viewer"];
}

/** Return why a new password cannot be used; empty when it can. @param {string} password @param {string} again */
export function passwordFault(password, again) {
  if (password.length < LEAST_CHARACTERS)
    return `The password has ${password.length} characters; it needs ${LEAST_CHARACTERS} or more.`;
  return password === again ? "" : "The two passwords differ; type the same one twice.";
}
