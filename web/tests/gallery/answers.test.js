import assert from "node:assert/strict";
import { test } from "node:test";
import * as answers from "../../foveacam_web/static/js/looking/answers.js";
import { withCorrected } from "../../foveacam_web/static/js/looking/corrects.js";
import { FAR, fixation, NEAR, only } from "../documents.js";

const SEES = { sees_target: true, reason: "" };
const HIDDEN = { sees_target: false, reason: "hidden from the left eye by something nearer" };
const BOUND = { nearest_m: 1.3, farthest_m: 8 };

test("the heading names the eye that measured with the wide camera", () => {
  const found = fixation({ ...FAR, left_view: HIDDEN, right_view: SEES });
  assert.deepEqual(answers.heading(found), {
    title: "Measured by the right fovea and the wide camera",
    tone: "good",
    hint: "",
  });
  assert.equal(answers.basisWords(found.basis, found), "right fovea and wide camera");
  assert.equal(answers.basisWords("fovea_and_wide"), "one fovea and wide camera");
  assert.equal(answers.basisShort(found.basis, found), "right fovea");
  assert.equal(answers.basisShort("surroundings", found), "from its surroundings");
  const each = fixation({ ...FAR, left_view: SEES, right_view: SEES });
  assert.equal(answers.heading(each).title, "Measured by each fovea and the wide camera");
  assert.equal(answers.basisWords(each.basis, each), "each fovea and wide camera");
});

test("the heading tells what was measured from what was inferred", () => {
  const titles = /** @type {const} */ (["both_foveae", "surroundings", "bound"]).map((basis) => {
    const { title, tone } = answers.heading(fixation({ basis }));
    return [title, tone];
  });
  assert.deepEqual(titles, [
    ["Measured by both foveae", "good"],
    ["Inferred from its surroundings", "plain"],
    ["Limits only", "plain"],
  ]);
});

test("a fixation without a basis says how it ended", () => {
  assert.equal(answers.heading(fixation({ state: "no_texture" })).title, "No texture here");
  assert.equal(answers.heading(fixation({ state: "verged" })).title, "Measured by both foveae"); // of an earlier version
});

test("limits are told at length and in short", () => {
  assert.equal(answers.boundText(BOUND), "farther than 1.3 m, nearer than 8.0 m");
  assert.equal(answers.boundShort(BOUND), "1.3 … 8.0 m");
  assert.equal(answers.boundText({ nearest_m: 1.3, farthest_m: null }), "farther than 1.3 m");
  assert.equal(answers.boundShort({ nearest_m: 1.3, farthest_m: null }), "> 1.3 m");
});

test("an answer is a distance, else its limits, else nothing", () => {
  assert.equal(answers.answerText(fixation({ ...NEAR, bound: BOUND })), "1.9370 ± 0.0040 m");
  assert.equal(answers.answerText(fixation({ basis: "bound", bound: BOUND })), "1.3 … 8.0 m");
  assert.equal(answers.answerText(fixation({})), "–");
});

test("the alternative that was chosen is the answer", () => {
  const open = fixation({ ...NEAR, alternatives: [NEAR, FAR] });
  assert.equal(answers.spoken(open), "Measured by both foveae. 1.9370 ± 0.0040 m. 2 distances are possible.");
  const chosen = { ...open, chosen_alternative: 1 };
  assert.equal(answers.basisOf(chosen), "fovea_and_wide");
  assert.equal(answers.answerText(answers.answerOf(chosen)), "2.729 ± 0.020 m");
  assert.equal(answers.spoken(chosen), "Measured by one fovea and the wide camera. 2.729 ± 0.020 m.");
});

test("a probability near 0 or 1 keeps a decimal", () => {
  assert.deepEqual([0.38, 0.999, 0.004].map(answers.percent), ["38 %", "99.9 %", "0.4 %"]);
});

const targets = /** @type {import("#api").TargetDocument[]} */ ([
  { id: "tgt-1", fixation_id: "fix-1", x_px: 360, y_px: 270 },
  { id: "tgt-2", fixation_id: "fix-2", x_px: 400, y_px: 270 },
  { id: "tgt-3", fixation_id: "fix-3", x_px: null, y_px: null },
]);
const shown = { targets, hidden_targets: [] };

test("a click on a target corrects it and one elsewhere does not", () => {
  assert.equal(withCorrected({ pixel: { x_px: 365, y_px: 272 } }, shown, 12).corrects, "fix-1");
  assert.equal(withCorrected({ pixel: { x_px: 385, y_px: 270 } }, shown, 30).corrects, "fix-2"); // the nearer one
  assert.equal("corrects" in withCorrected({ pixel: { x_px: 860, y_px: 620 } }, shown, 12), false);
  assert.equal(
    "corrects" in withCorrected({ pixel: { x_px: 360, y_px: 270 } }, { targets, hidden_targets: ["tgt-1"] }, 12),
    false,
  );
});

test("a rectangle corrects the only target inside it", () => {
  const box = (/** @type {number} */ width_px) => ({ rectangle: { x_px: 350, y_px: 260, width_px, height_px: 20 } });
  assert.equal(withCorrected(box(20), shown, 12).corrects, "fix-1");
  assert.equal("corrects" in withCorrected(box(100), shown, 12), false);
});

test("a direction corrects nothing, and neither does a page that has no targets yet", () => {
  assert.equal("corrects" in withCorrected({ direction: { ax_deg: 1, ay_deg: 2 } }, shown, 12), false);
  assert.equal(
    "corrects" in withCorrected({ pixel: { x_px: 360, y_px: 270 } }, only({ targets: null, hidden_targets: [] }), 12),
    false,
  );
});
