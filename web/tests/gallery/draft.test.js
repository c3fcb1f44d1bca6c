import assert from "node:assert/strict";
import { afterEach, beforeEach, mock, test } from "node:test";
import { keepDraft } from "../../foveacam_web/static/js/capturing/capture/draft.js";
import { only } from "../documents.js";

/** @typedef {import("#page").WholeDraft} WholeDraft */

const KEY = "foveacam.capture.draft";
/** @type {WholeDraft} */
const DEFAULTS = only({ source: "grid", columns: 9, text: "", across: null, distance_m: null, exposures_ms: [] });
/** @type {WholeDraft} */
const TYPED = only({ ...DEFAULTS, columns: 3, distance_m: 2.5, exposures_ms: [4, 8] });
const REFUSING = { getItem: refuse, setItem: refuse, removeItem: refuse };

/** @type {Map<string, string>} */
let kept;
let page = new EventTarget();
let draft = DEFAULTS;

beforeEach(() => {
  kept = new Map();
  page = new EventTarget();
  draft = DEFAULTS;
  give("window", page);
  give("localStorage", {
    getItem: (/** @type {string} */ key) => kept.get(key) ?? null,
    setItem: (/** @type {string} */ key, /** @type {string} */ value) => kept.set(key, value),
    removeItem: (/** @type {string} */ key) => kept.delete(key),
  });
  mock.timers.enable({ apis: ["setTimeout"] });
});
afterEach(() => mock.timers.reset());

test("what differs from the defaults is kept after a rest or at the page's end, and restored", () => {
  const fields = opened();
  draft = TYPED;
  fields.changed();
  assert.equal(kept.size, 0);
  mock.timers.tick(300);
  assert.deepEqual([restored(), fields.differs()], [TYPED, true]);
  draft = { ...TYPED, columns: 4 };
  fields.changed();
  page.dispatchEvent(new Event("pagehide"));
  assert.equal(restored().columns, 4);
});

test("defaults are not kept", () => {
  kept.set(KEY, JSON.stringify({ version: 1, draft: TYPED }));
  const fields = opened();
  assert.deepEqual(draft, TYPED);
  draft = fields.defaults;
  fields.changed();
  mock.timers.tick(300);
  assert.deepEqual([kept.size, fields.differs()], [0, false]);
});

for (const [what, change] of /** @type {[string, object][]} */ ([
  ["of another version", { version: 0 }],
  ["of another version without a field", { draft: { ...TYPED, text: undefined } }],
  ["whose number is a text", { draft: { ...TYPED, columns: "3" } }],
  ["whose choice there is not", { draft: { ...TYPED, source: "spiral" } }],
  ["whose list holds a text", { draft: { ...TYPED, exposures_ms: ["4"] } }],
  ["that is empty", { draft: undefined }],
]))
  test(`a draft ${what} is passed over`, () => {
    kept.set(KEY, JSON.stringify({ version: 1, draft: TYPED, ...change }));
    assert.deepEqual(restored(), DEFAULTS);
  });

test("a draft that is cut short is passed over", () => {
  kept.set(KEY, '{"version": 1, "dra');
  assert.deepEqual(restored(), DEFAULTS);
});

test("a browser that keeps nothing takes drafts all the same", () => {
  give("localStorage", REFUSING);
  const fields = opened();
  draft = TYPED;
  fields.changed();
  mock.timers.tick(300);
  assert.deepEqual([fields.differs(), fields.defaults], [true, DEFAULTS]);
});

function opened() {
  return keepDraft({ read: () => draft, put: (found) => (draft = found) });
}

/** Return what a page that is loaded now has. */
function restored() {
  const before = draft;
  draft = DEFAULTS;
  opened();
  const found = draft;
  draft = before;
  return found;
}

/** @param {string} name @param {unknown} value */
function give(name, value) {
  Object.defineProperty(globalThis, name, { value, configurable: true });
}

function refuse() {
  throw new DOMException("off");
}
