import assert from "node:assert/strict";
import { test } from "node:test";
import { RequestError, request } from "../foveacam_web/static/js/transport/api.js";
import {
  agoWords,
  askerWords,
  auditPath,
  browserWords,
  contentOf,
  doingWords,
  isExpired,
  nameFault,
  removalWords,
  requestWords,
  scopeWords,
  stateWords,
  tokenWords,
  tokensOf,
  userName,
} from "../foveacam_web/static/js/operating/people/words.js";
import {
  isNamed,
  may,
  offers,
  passwordFault,
  roleWords,
  whoWords,
} from "../foveacam_web/static/js/operating/session/words.js";
import { signIn } from "../foveacam_web/static/js/transport/sign_in.js";
import { only } from "./documents.js";

/** @typedef {import("#api").SignInDocument} SignInDocument */

const NOW_MS = Date.parse("2026-01-01T12:00:00.000Z");
/** @type {SignInDocument} */
const VIEWER = { mode: "users", name: "Linus", kind: "user", role: "viewer", rights: ["view"], expires_utc: null };
/** @type {SignInDocument} */
const ADMIN = { ...VIEWER, name: "Ada", role: "admin", rights: ["view", "operate", "administer"] };
/** @type {SignInDocument} */
const OPEN = { ...ADMIN, mode: "open", name: null, kind: "local" };
/** @type {SignInDocument} */
const TOKEN = { ...OPEN, mode: "token", kind: "shared_token", role: null, name: "the shared token" };

test("a button that needs a right is offered to who has it, and before it is known who looks", () => {
  assert.equal(offers(VIEWER, "administer"), false);
  assert.equal(offers(ADMIN, "administer"), true);
  assert.equal(offers(null, "administer"), true);
});

test("who is signed in is said where the server asks for it", () => {
  assert.deepEqual([null, OPEN, TOKEN, VIEWER].map(isNamed), [false, false, true, true]);
  assert.deepEqual([OPEN, TOKEN, VIEWER].map(whoWords), ["This machine", "Shared token", "Linus"]);
});

test("who has no role gets the words of its rights", () => {
  assert.equal(roleWords(VIEWER).name, "Viewer");
  assert.equal(roleWords(TOKEN).name, "Admin");
  assert.equal(roleWords({ ...TOKEN, rights: ["view", "operate"] }).name, "Operator");
  assert.deepEqual([may(VIEWER, "operate"), may(ADMIN, "operate"), may(null, "view")], [false, true, false]);
});

test("the page shows the first admin's form, all of it, or one's own sign-ins", () => {
  assert.deepEqual([OPEN, TOKEN, ADMIN, VIEWER].map(contentOf), ["first", "first", "all", "own"]);
  assert.equal(contentOf({ ...TOKEN, rights: ["view"] }), "own");
});

test("a password is refused with the reason before it is sent", () => {
  assert.match(passwordFault("short", "short"), /5 characters.*10/);
  assert.match(passwordFault("long enough", "long enougH"), /differ/);
  assert.equal(passwordFault("long enough", "long enough"), "");
});

test("somebody who is disabled is not called guessed at or invited", () => {
  const state = (/** @type {object} */ fields) =>
    stateWords(only({ state: "active", guessed_at: false, ...fields })).text;
  assert.equal(state({}), "Active");
  assert.equal(state({ state: "invited" }), "Invited");
  assert.equal(state({ guessed_at: true }), "Guessed at");
  assert.equal(state({ state: "disabled", guessed_at: true }), "Disabled");
});

test("who is removed leaves programs, which are named", () => {
  const tokens = only([
    { name: "nightly", prefix: "fcd_k3J9", scopes: ["view", "operate"], owner: "grace" },
    { name: "other", prefix: "fcd_a", scopes: ["view"], owner: "ada" },
    { name: "shared", prefix: "fcd_b", scopes: ["view"], owner: null },
  ]);
  assert.deepEqual(tokensOf(tokens, "grace").map(tokenWords), ["nightly (fcd_k3J9…), which may see, operate"]);
  assert.doesNotMatch(removalWords("grace", 0), /program/);
  assert.match(removalWords("grace", 1), /A program works on grace’s authority/);
  assert.match(removalWords("grace", 2), /2 programs work/);
});

test("ages are said in words, also of what never was", () => {
  assert.equal(agoWords(null, NOW_MS), "never");
  assert.equal(agoWords("2026-01-01T11:59:30.000Z", NOW_MS), "just now");
  assert.equal(agoWords("2026-01-01T11:00:00.000Z", NOW_MS), "60 min ago");
  assert.equal(agoWords("nonsense", NOW_MS), "–");
});

test("browsers are named, and what is none is quoted", () => {
  const chrome = "Mozilla/5.0 (X11; Linux x86_64) AppleWebKit/537.36 (KHTML, like Gecko) Chrome/120.0 Safari/537.36";
  assert.equal(browserWords(chrome), "Chrome on Linux");
  assert.equal(browserWords(chrome.replace("X11; Linux x86_64", "Macintosh") + " Edg/120.0"), "Edge on Mac");
  assert.equal(browserWords("curl/8.5"), "curl/8.5");
  assert.equal(browserWords(""), "unknown");
});

test("a token for ever does not expire, and scopes come in their order", () => {
  assert.equal(isExpired({ expires_utc: null }, NOW_MS), false);
  assert.equal(isExpired({ expires_utc: "2026-01-01T11:59:59.000Z" }, NOW_MS), true);
  assert.equal(scopeWords(["operate", "view"]), "See, Operate");
});

test("an entry of the log says who did what and how often", () => {
  const entry = (/** @type {object} */ fields) => only({ who: "ada", kind: "user", repeated: 1, ...fields });
  assert.equal(askerWords(entry({})), "ada");
  assert.equal(askerWords(entry({ who: "nightly", kind: "service" })), "nightly (service)");
  assert.equal(doingWords(entry({ what: "Add a user", detail: "linus, viewer" })), "Add a user: linus, viewer");
  assert.equal(doingWords(entry({ what: "", detail: "" })), "");
  assert.equal(requestWords(entry({ method: "POST", path: "/api/v1/stop", repeated: 3 })), "POST /stop ×3");
  assert.equal(requestWords(entry({ method: "POST", path: "/sign_in" })), "POST /sign_in");
});

test("a name is sent as the server takes it", () => {
  assert.equal(userName(" Ada.Lovelace "), "ada.lovelace");
  assert.deepEqual(["Ada", "9@lab.example"].map(nameFault), ["", ""]);
  for (const name of ["", "ada lovelace", ".ada", "Zoë"]) assert.match(nameFault(name), /begins with a letter/);
});

test("the log is read with what is searched for alone", () => {
  const all = { text: " ", who: "", outcome: "", before: null, limit: 50 };
  assert.equal(auditPath(all), "/audit?limit=50");
  const some = { ...all, text: "a&b", who: "Ada ", outcome: "failed", before: 7 };
  assert.equal(auditPath(some), "/audit?limit=50&text=a%26b&who=Ada&outcome=failed&before=7");
});

test("an answer to nobody tells of a lost sign-in, that to a wrong password does not", async (t) => {
  let slug = "wrong-credentials";
  t.mock.method(globalThis, "fetch", async () => Response.json({ type: `/problems/${slug}` }, { status: 401 }));
  let told = 0;
  signIn.addEventListener("refused", () => (told += 1));
  const ask = () => request("GET", "/users").catch((error) => assert.ok(error instanceof RequestError));
  await ask();
  assert.equal(told, 0);
  slug = "unauthorized";
  await ask();
  assert.equal(told, 1);
});

test("while the browser is signed out nothing but its sign-in and the stop is sent", async (t) => {
  const sent = t.mock.method(globalThis, "fetch", async () => new Response("{}", { status: 200 }));
  signIn.over = true;
  t.after(() => (signIn.over = false));
  await assert.rejects(
    request("GET", "/rig"),
    (error) => error instanceof RequestError && error.document.status === 401,
  );
  assert.equal(sent.mock.callCount(), 0);
  await request("POST", "/stop");
  await request("GET", "/session");
  assert.equal(sent.mock.callCount(), 2);
});
