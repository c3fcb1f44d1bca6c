// Shows the trigger: its rate, the source of its settle time, and the self-test of each eye's line.

import { badge, figures, nothing, starter } from "../calibration/parts.js";
import { changing, fill, h } from "../dom.js";
import { clockTime, millis, MISSING, number, sentence } from "../format.js";
import { takesOrders, VERDICTS } from "./words.js";

/**
 * @import { EyeTestDocument, TriggerDocument, TriggerTestDocument } from "#api"
 * @import { ConsoleState, RunningTest } from "#page"
 * @import { Store } from "../store.js"
 * @import { RigOrders } from "./orders.js"
 */

/**
 * @param {HTMLElement} place
 * @param {{store: Store, orders: RigOrders}} context
 */
export function mountTrigger(place, { store, orders }) {
  const [budget, verdicts, running] = [h("div", {}), h("div", { class: "stack" }), h("div", {})];
  const start = starter({
    label: "Test both triggers",
    store,
    act: () => orders.testTriggers(),
    keys: ["rig", "running_test"],
    why: (state) => (state.running_test ? "A test runs." : eyesMissing(state)),
  });
  fill(
    place,
    budget,
    h("h4", { text: "Self-test" }),
    h("p", {
      class: "lead",
      text: "A command to each eye, then one pulse of the controller to both. What ran before is restored; it takes a few seconds.",
    }),
    h("div", { class: "actions" }, start),
    running,
    verdicts,
    meanings(),
  );
  const showBudget = changing(budget, budgetOf);
  const showVerdicts = changing(verdicts, verdictsOf);
  const showRunning = changing(running, (/** @type {RunningTest | null} */ now) => (now ? progress(now, orders) : []));
  store.on(["rig", "trigger_test", "running_test", "rig_page"], ({ rig, trigger_test, running_test, rig_page }) => {
    if (!rig_page) return;
    showBudget(rig?.trigger ?? null);
    showVerdicts(trigger_test);
    showRunning(running_test);
  });
}

/** @param {ConsoleState} state */
function eyesMissing({ rig }) {
  const missing = ["left", "right"].filter((eye) => !takesOrders(rig?.cameras.find(({ role }) => role === eye)));
  return missing.length > 0 ? `The ${missing.join(" and ")} camera is missing.` : null;
}

/** @param {TriggerDocument | null} trigger */
function budgetOf(trigger) {
  if (!trigger) return [nothing("No budget: the rig is not open yet.")];
  const { settle_us, settle_source, interval_ms, rate_hz } = trigger;
  return [
    h(
      "p",
      { class: "budget" },
      h("strong", { class: "number", text: rate_hz === null ? MISSING : `${number(rate_hz, 1)} Hz` }),
      h("span", {
        text:
          interval_ms === null
            ? "not known until both cameras say how fast they can be"
            : `at most: a look of both foveae every ${number(interval_ms, 2)} ms`,
      }),
    ),
    figures([
      ["Mirrors settle", `${number(settle_us / 1000, 2)} ms`],
      ["Known from", settle_source === "rig file" ? "the rig file, not measured" : settle_source],
    ]),
    h("p", {
      class: "lead",
      text: "One look is the settling, then the slower camera's exposure or read-out, whichever is longer, and a margin.",
    }),
  ];
}

/**
 * @param {RunningTest} now
 * @param {RigOrders} orders
 */
function progress({ note, done, total }, orders) {
  return [
    h(
      "p",
      { class: "state running", role: "status" },
      h("span", { class: "spinner", "aria-hidden": "true" }),
      `${sentence(note || "waiting for its turn")} ${total ? `${done} of ${total}` : ""}`,
      h("button", {
        type: "button",
        class: "plain",
        data: { keep: "cancel-test" },
        text: "Cancel",
        on: { click: () => void orders.cancelTest() },
      }),
    ),
  ];
}

/** @param {TriggerTestDocument | null} found */
function verdictsOf(found) {
  if (!found) return [nothing("Not read yet.")];
  return [
    h("ul", { class: "verdicts" }, found.eyes.map(eyeRow)),
    found.created_utc &&
      h("p", {
        class: "why",
        text: `Tested ${new Date(found.created_utc).toLocaleDateString()} at ${clockTime(found.created_utc)}`,
      }),
  ];
}

/** @param {EyeTestDocument} found */
function eyeRow({ eye, verdict, detail, software_ms, hardware_ms }) {
  const { text, tone, meaning } = VERDICTS[verdict] ?? { text: verdict, tone: "plain", meaning: "" };
  const times = [
    software_ms !== null && `command to frame ${millis(software_ms)}`,
    hardware_ms !== null && `pulse to frame ${millis(hardware_ms)}`,
  ]
    .filter(Boolean)
    .join(", ");
  return h(
    "li",
    { data: { eye } },
    h("span", { class: `name eye-${eye}`, text: eye === "left" ? "Left" : "Right" }),
    badge(tone, text, meaning),
    verdict !== "untested" && h("p", { class: "lead", text: sentence(detail) }),
    times && h("p", { class: "why number", text: times }),
  );
}

function meanings() {
  return h(
    "details",
    {},
    h("summary", { text: "What each verdict means" }),
    h(
      "dl",
      { class: "meanings" },
      Object.values(VERDICTS).flatMap(({ text, tone, meaning }) => [
        h("dt", {}, badge(tone, text)),
        h("dd", { text: meaning }),
      ]),
    ),
  );
}
