// Words and arithmetic of the page of people and their rights. Pure functions.

import { deviceOf } from "../../devices/display/words.js";
import { MISSING, span } from "../../elements/format.js";
import { ROLES } from "../session/words.js";

/**
 * @import { Right } from "#page"
 * @import { AuditDocument, ServiceTokenDocument, SignInDocument, UserDocument } from "#api"
 */

/**
 * A part of what a browser calls itself, and its name; Edge calls itself Chrome too, and Chrome Safari.
 * @type {[string, string][]}
 */
const BROWSERS = [
  ["Edg", "Edge"],
  ["Firefox/", "Firefox"],
  ["Chrome/", "Chrome"],
  ["Safari/", "Safari"],
];
const NAME = /^[a-z0-9][a-z0-9._@+-]*$/;

/** What a service may be allowed, in plain words. @type {readonly {right: Right, name: string, does: string}[]} */
export const SCOPES = Object.freeze([
  { right: "view", name: "See", does: "pictures, depth, datasets and states" },
  { right: "operate", name: "Operate", does: "move the rig, capture, record, calibrate, change settings" },
  {
    right: "administer",
    name: "Administer",
    does: "set the rig up, put calibrations in force, delete for good, manage people",
  },
]);

/** @type {[string, string][]} */
export const ROLE_CHOICES = Object.entries(ROLES).map(([role, { name }]) => [role, name]);

/** @type {Readonly<Record<AuditDocument["outcome"], {text: string, tone: string}>>} */
export const OUTCOMES = Object.freeze({
  done: { text: "Done", tone: "good" },
  refused: { text: "Refused", tone: "warn" },
  failed: { text: "Failed", tone: "bad" },
});

/** @type {[string, string][]} */
export const OUTCOME_CHOICES = Object.entries(OUTCOMES).map(([outcome, { text }]) => [outcome, text.toLowerCase()]);

/** What it means that there are no users yet, by mode of sign-in. */
export const MODES = Object.freeze({
  open: "This server has no sign-in: every user of this machine may do everything.",
  token:
    "This server has one shared token: everybody who has it may do everything, until it is removed from the settings.",
});

/** Return what a page can show at all. @param {SignInDocument} sign_in @returns {"first" | "all" | "own"} */
export function contentOf({ mode, rights }) {
  if (!rights.includes("administer")) return "own";
  return mode === "users" ? "all" : "first";
}

/** @param {UserDocument} user @returns {{text: string, tone: string, title: string}} */
export function stateWords({ state, guessed_at }) {
  if (state === "disabled")
    return { text: "Disabled", tone: "plain", title: "Cannot sign in, nor can programs on this authority" };
  if (guessed_at)
    return {
      text: "Guessed at",
      tone: "warn",
      title:
        "Many wrong passwords came in the last hour: new browsers wait their turn, known ones sign in as ever; a new link ends it",
    };
  if (state === "invited") return { text: "Invited", tone: "warn", title: "Has not opened the link yet" };
  return { text: "Active", tone: "good", title: "Can sign in" };
}

/**
 * Return how long ago something was.
 * @param {string | null} utc
 * @param {number} now_ms
 */
export function agoWords(utc, now_ms) {
  if (utc === null) return "never";
  const age_s = (now_ms - Date.parse(utc)) / 1000;
  if (!Number.isFinite(age_s)) return MISSING;
  return age_s < 60 ? "just now" : `${span(age_s)} ago`;
}

/** Name a browser and its device. @param {string} agent */
export function browserWords(agent) {
  const browser = BROWSERS.find(([sign]) => agent.includes(sign))?.[1];
  const device = deviceOf(agent);
  return browser && device ? `${browser} on ${device}` : agent || "unknown";
}

/** @param {Pick<ServiceTokenDocument, "expires_utc">} token @param {number} now_ms */
export function isExpired({ expires_utc }, now_ms) {
  return expires_utc !== null && Date.parse(expires_utc) <= now_ms;
}

/** @param {Right[]} scopes */
export function scopeWords(scopes) {
  return SCOPES.filter(({ right }) => scopes.includes(right))
    .map(({ name }) => name)
    .join(", ");
}

/** Return the service tokens that a user owns. @param {ServiceTokenDocument[]} tokens @param {string} name */
export function tokensOf(tokens, name) {
  return tokens.filter(({ owner }) => owner === name);
}

/** @param {ServiceTokenDocument} token */
export function tokenWords({ name, prefix, scopes }) {
  return `${name} (${prefix}…), which may ${scopeWords(scopes).toLowerCase()}`;
}

/** Return the consequences of removing a user, also for the user's programs. @param {string} name @param {number} count */
export function removalWords(name, count) {
  const text = `${name} is signed out everywhere and cannot sign in any more. What ${name} has captured stays.`;
  if (count === 0) return text;
  const programs = count === 1 ? "A program works" : `${count} programs work`;
  return `${text} ${programs} on ${name}’s authority; a token that is kept becomes yours:`;
}

/** Return whose request an entry is about. @param {AuditDocument} entry */
export function askerWords({ who, kind }) {
  return kind === "service" ? `${who} (service)` : who;
}

/** Return the requested operation, with the server's detail if there is one. @param {AuditDocument} entry */
export function doingWords({ what, detail }) {
  return [what, detail].filter(Boolean).join(": ");
}

/** Return what was sent. @param {AuditDocument} entry */
export function requestWords({ method, path, repeated }) {
  return [method, path.replace(/^\/api\/v1(?=\/)/, ""), repeated > 1 && `×${repeated}`].filter(Boolean).join(" ");
}

/** Return why a name is not valid; empty for a valid one. @param {string} name */
export function nameFault(name) {
  if (NAME.test(userName(name))) return "";
  return "A name has letters, digits and . _ @ + - alone, and begins with a letter or digit; choose another one.";
}

/** Return a name as the server takes it: without capitals. @param {string} name */
export function userName(name) {
  return name.trim().toLowerCase();
}

/**
 * Return the path that reads a part of the log.
 * @param {{text: string, who: string, outcome: string, before: number | null, limit: number}} wanted
 */
export function auditPath({ text, who, outcome, before, limit }) {
  const query = new URLSearchParams({ limit: String(limit) });
  for (const [name, value] of Object.entries({ text: text.trim(), who: who.trim(), outcome })) {
    if (value !== "") query.set(name, value);
  }
  if (before !== null) query.set("before", String(before));
  return `/audit?${query}`;
}
