import assert from "node:assert/strict";
import { test } from "node:test";
import {
  SOURCES,
  USUAL_LAYOUT,
  closePane,
  exchangePane,
  layoutOf,
  layoutText,
  moveDivider,
  nextSource,
  placesOf,
  sourcesOf,
  splitPane,
  windowAddress,
} from "../foveacam_web/static/js/operating/windows/layout.js";
import { absenceWords, lossWords } from "../foveacam_web/static/js/operating/windows/loss.js";
import { only } from "./documents.js";

const TEXT = "row-600(wide,column-500(left,right))";

test("a layout and its address are the same", () => {
  for (const text of ["left", TEXT, "column-250(scene,row-900(wide_depth,column-100(depth,anaglyph)))"]) {
    const layout = layoutOf(text);
    assert.ok(layout);
    assert.equal(layoutText(layout), text);
  }
  assert.equal(layoutText(USUAL_LAYOUT), TEXT);
  assert.equal(windowAddress("left"), "/windows#left");
});

test("an address that cannot be shown has no layout", () => {
  const nested = "row-500(wide,".repeat(40) + "left" + ")".repeat(40);
  const wrong = [
    "",
    "middle",
    "row-500(wide)",
    "row-500(wide,left",
    `${TEXT})`,
    "row-500(wide,wide)",
    "row(wide,left)",
  ];
  for (const text of [...wrong, nested, "<b>", "row-500[wide,left]"]) assert.equal(layoutOf(text), null, text);
});

test("a split halves the pane and shows a source that is not shown yet", () => {
  const added = nextSource(USUAL_LAYOUT);
  assert.equal(added, "anaglyph");
  const layout = splitPane(USUAL_LAYOUT, "left", "row", "anaglyph");
  assert.equal(layoutText(layout), "row-600(wide,column-500(row-500(left,anaglyph),right))");
});

test("splits go on until every source is shown", () => {
  /** @type {import("#page").Layout} */
  let layout = "wide";
  for (let added = nextSource(layout); added; added = nextSource(layout))
    layout = splitPane(layout, added === "left" ? "wide" : "left", "column", added);
  assert.deepEqual(sourcesOf(layout).sort(), [...SOURCES].sort());
  assert.deepEqual(layoutOf(layoutText(layout)), layout);
});

test("a closed pane leaves its room to its neighbour, and the last pane stays", () => {
  assert.equal(layoutText(closePane(USUAL_LAYOUT, "left")), "row-600(wide,right)");
  assert.equal(layoutText(closePane(USUAL_LAYOUT, "wide")), "column-500(left,right)");
  assert.equal(closePane("wide", "wide"), "wide");
});

test("two panes change places, or one shows what no pane shows", () => {
  assert.equal(layoutText(exchangePane(USUAL_LAYOUT, "wide", "right")), "row-600(right,column-500(left,wide))");
  assert.equal(layoutText(exchangePane(USUAL_LAYOUT, "wide", "scene")), "row-600(scene,column-500(left,right))");
});

test("a divider moves, and no pane becomes narrower than a tenth", () => {
  assert.equal(layoutText(moveDivider(USUAL_LAYOUT, "1", 0.25)), "row-600(wide,column-250(left,right))");
  assert.equal(layoutText(moveDivider(USUAL_LAYOUT, "", 2)), "row-900(wide,column-500(left,right))");
  assert.equal(layoutText(moveDivider(USUAL_LAYOUT, "", -1)), "row-100(wide,column-500(left,right))");
});

test("the panes fill the window without overlap", () => {
  const { panes, dividers } = placesOf(USUAL_LAYOUT);
  assert.deepEqual(panes[2], { source: "right", box: { left: 0.6, top: 0.5, width: 0.4, height: 0.5 } });
  const area = panes.reduce((sum, { box }) => sum + box.width * box.height, 0);
  assert.ok(Math.abs(area - 1) < 1e-12);
  assert.deepEqual(
    dividers.map(({ path, axis }) => `${path}:${axis}`),
    [":row", "1:column"],
  );
});

/** @param {object} fields */
const state = (fields) =>
  only({
    stream: "open",
    rig: { cameras: [{ role: "left", connected: true }] },
    shown: { left: { count: 5, age_ms: 12_400, silent_ms: 100 } },
    server_stats: {},
    ...fields,
  });
/** @type {{needs: import("#page").Role[], live: boolean}} */
const LEFT = { needs: ["left"], live: true };

test("a lost source says how old its last picture is", () => {
  assert.equal(lossWords(state({}), "left", LEFT), null);
  const words = "Last picture 12 s old";
  assert.equal(lossWords(state({ stream: "down" }), "left", LEFT), words);
  assert.equal(lossWords(state({ rig: { cameras: [{ role: "left", connected: false }] } }), "left", LEFT), words);
  const silent = { left: { count: 5, age_ms: 12_400, silent_ms: 3000 } };
  assert.equal(lossWords(state({ shown: silent }), "left", LEFT), words);
  assert.equal(lossWords(state({ shown: silent }), "left", { ...LEFT, live: false }), null);
  assert.equal(lossWords(state({ stream: "down", shown: {} }), "left", LEFT), null);
});

test("the 3D view says how long the server is away", () => {
  assert.equal(absenceWords(null, 9000), null);
  assert.equal(absenceWords(1000, 9000), "No connection for 8.0 s");
});
