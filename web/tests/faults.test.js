import assert from "node:assert/strict";
import { test } from "node:test";
import {
  MOST,
  placeWords,
  trayLabel,
  trayRows,
  trayTone,
  whenWords,
  withoutPresent,
  withPageFault,
} from "../foveacam_web/static/js/devices/faults/words.js";

/** @param {Partial<import("#api").FaultDocument>} [fields] @returns {import("#api").FaultDocument} */
const fault = (fields) => ({
  id: "fault-1",
  level: "error",
  scope: "device",
  name: "mirrors",
  what: "it does not answer",
  remedy: "check its cable",
  first_utc: "2026-01-01T10:00:00.000Z",
  last_utc: "2026-01-01T10:00:00.000Z",
  count: 1,
  present: true,
  over_utc: null,
  ...fields,
});

const LINK = { scope: "link", name: "server", what: "no connection", remedy: "see", lasting: true };
const time = (/** @type {string} */ utc) => utc.slice(11, 16);

test("errors come first, the newest first within, of server and page alike", () => {
  const rows = trayRows(
    [
      fault({ id: "warning", level: "warning", last_utc: "2026-01-01T12:00:00.000Z" }),
      fault({ id: "old", last_utc: "2026-01-01T10:00:00.000Z" }),
    ],
    [fault({ id: "page", last_utc: "2026-01-01T11:00:00.000Z" })],
  );
  assert.deepEqual(
    rows.map(({ id }) => id),
    ["page", "old", "warning"],
  );
});

test("the tray has 50 rows at most", () => {
  const rows = Array.from({ length: MOST + 5 }, (_, index) => fault({ id: `fault-${index}` }));
  assert.equal(trayRows(rows, [fault()]).length, MOST);
});

test("the button has no colour without faults, red while an error is present, else amber", () => {
  assert.equal(trayTone([]), "none");
  assert.equal(trayTone([fault({ level: "warning" }), fault()]), "bad");
  assert.equal(trayTone([fault({ present: false })]), "warn");
});

test("the button says how many there are of which kind", () => {
  assert.equal(trayLabel([]), "Faults and warnings: none");
  assert.equal(
    trayLabel([fault(), fault({ present: false }), fault({ level: "warning" })]),
    "Faults and warnings, 3: 2 errors, 1 warning; 2 present",
  );
  assert.equal(trayLabel([fault({ present: false })]), "Faults and warnings, 1: 1 error; all over");
});

test("a row names what it concerns, also of a scope that the page does not know", () => {
  assert.equal(placeWords(fault({ scope: "storage", name: "event log" })), "Storage: event log");
  assert.equal(placeWords(fault({ scope: "wide_depth", name: "kept_cells" })), "wide depth: kept cells");
});

test("a row says how often it came and since when it is over", () => {
  assert.equal(whenWords(fault(), time), "10:00");
  const again = fault({ count: 3, last_utc: "2026-01-01T10:05:00.000Z" });
  assert.equal(whenWords(again, time), "3 times, first 10:00, last 10:05");
  const over = { present: false, over_utc: "2026-01-01T10:07:00.000Z" };
  assert.equal(whenWords({ ...again, ...over }, time), "3 times, first 10:00, last 10:05, over since 10:07");
  const moment = fault({ present: false, over_utc: "2026-01-01T10:00:00.000Z" });
  assert.equal(whenWords(moment, time), "10:00");
});

test("a fault of the page is counted, and over when the server is back", () => {
  const lost = withPageFault([], LINK, "2026-01-01T10:00:00.000Z");
  const back = withoutPresent(lost, "link", "2026-01-01T10:01:00.000Z");
  const again = withPageFault(back, LINK, "2026-01-01T10:02:00.000Z");

  assert.deepEqual([lost[0]?.present, back[0]?.present, again[0]?.present], [true, false, true]);
  assert.deepEqual([back[0]?.over_utc, again[0]?.count, again.length], ["2026-01-01T10:01:00.000Z", 2, 1]);
  assert.equal(again[0]?.first_utc, "2026-01-01T10:00:00.000Z");
});

test("an error of a script is over at once and leaves the lost server as it is", () => {
  const script = { scope: "page", name: "script", what: "x is not a function", remedy: "reload", lasting: false };
  const rows = withPageFault(withPageFault([], LINK, "2026-01-01T10:00:00.000Z"), script, "2026-01-01T10:01:00.000Z");
  assert.deepEqual(
    rows.map(({ scope, present }) => [scope, present]),
    [
      ["page", false],
      ["link", true],
    ],
  );
});
