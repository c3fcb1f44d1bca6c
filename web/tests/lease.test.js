import assert from "node:assert/strict";
import { test } from "node:test";

import { holderName, leaseBadge, leaseWays, leaseWords } from "../foveacam_web/static/js/operating/lease/words.js";

/** @import { SignInDocument } from "#api" */

const FREE = { holder: null, expires_in_s: null, person: null, idle_s: null, asked_by: null };
const ADA = { holder: "ada", expires_in_s: 12, person: "ada", idle_s: 4, asked_by: null };

/** @param {string | null} name @param {SignInDocument["rights"]} [rights] @returns {SignInDocument} */
function signIn(name, rights = ["view", "operate"]) {
  return { mode: "users", name, kind: "user", role: "operator", rights, expires_utc: null };
}

/** @param {object} [more] */
function ways(more = {}) {
  const found = leaseWays({ lease: ADA, mine: false, sign_in: signIn("otto"), asked: false, ...more });
  return Object.entries(found)
    .filter(([, open]) => open)
    .map(([way]) => way)
    .join(" ");
}

test("what one may do about control depends on who holds it and who one is", () => {
  assert.equal(ways({ lease: FREE }), "take");
  assert.equal(ways(), "reason ask");
  assert.equal(ways({ asked: true }), "reason");
  assert.equal(ways({ sign_in: signIn("iris", ["view", "operate", "administer"]) }), "over reason ask");
  assert.equal(ways({ sign_in: signIn("ada") }), "over");
  assert.equal(ways({ mine: true }), "give");
  assert.equal(ways({ mine: true, lease: { ...ADA, asked_by: "otto" } }), "give answer");
  assert.equal(ways({ lease: { ...ADA, person: null }, sign_in: null }), "over");
});

test("words say who has control, how long it is idle, and who asks", () => {
  const other = { lease: ADA, mine: false, sign_in: signIn("otto"), asked: false };
  assert.equal(leaseWords(other), "ada has control.");
  assert.match(leaseWords({ ...other, lease: { ...ADA, idle_s: 185 } }), /Nothing was moved for 3 min\./);
  assert.match(leaseWords({ ...other, asked: true }), /You asked for it/);
  assert.match(leaseWords({ ...other, lease: { ...ADA, person: null } }), /written into the event log/);
  assert.match(leaseWords({ ...other, lease: FREE }), /Nobody has control/);
  assert.match(leaseWords({ ...other, mine: true }), /You have control/);
  assert.equal(leaseBadge(ADA, false), "ada has control");
  assert.equal(leaseBadge(FREE, false), "Control is free");
  assert.equal(leaseBadge({ ...ADA, asked_by: "otto" }, true), "otto asks for control");
});

test("a person is called by the name of the sign-in", () => {
  assert.equal(holderName(signIn("ada")), "ada");
  assert.equal(holderName({ ...signIn("x"), mode: "open" }), "operator");
  assert.equal(holderName(null), "operator");
});
