// Shows the trigger: its rate, the source of its settle time, and the self-test of each eye's line.

import { badge, figures, nothing, starter, textButton } from "../../elements/parts.js";
import { changing, fill, h, html } from "../../elements/dom.js";
import { dayTime, millis, MISSING, number, sentence } from "../../elements/format.js";
import { takesOrders, VERDICTS } from "./words.js";

/**
 * @import { EyeTestDocument, TriggerDocument, TriggerTestDocument } from "#api"
 * @import { ConsoleState, Job, Store } from "#console"
 * @import { RigOrders } from "./orders.js"
 */

/** @param {HTMLElement} place @param {{store: Store, orders: RigOrders}} context */
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
    html`<h4>Self-test</h4>`,
    html`<p class="lead">
      A command to each eye, then one pulse of the controller to both. What ran before is restored; it takes a few
      seconds.
    </p>`,
    html`<div class="actions">${start}</div>`,
    running,
    verdicts,
    meanings(),
  );
  const showBudget = changing(budget, budgetOf);
  const showVerdicts = changing(verdicts, verdictsOf);
  const showRunning = changing(running, (/** @type {Job | null} */ now) => (now ? progress(now, orders) : []));
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
    html`<p class="budget">
      <strong class="number">${rate_hz === null ? MISSING : `${number(rate_hz, 1)} Hz`}</strong>
      <span>
        ${
          interval_ms === null
            ? "not known until both cameras report their read-out time"
            : `at most: a look of both foveae every ${number(interval_ms, 2)} ms`
        }
      </span>
    </p>`,
    figures([
      ["Mirrors settle", `${number(settle_us / 1000, 2)} ms`],
      ["Known from", settle_source === "rig file" ? "the rig file, not measured" : settle_source],
    ]),
    html`<p class="lead">
      One look is the settling, then the slower camera's exposure or read-out, whichever is longer, and a margin.
    </p>`,
  ];
}

/** @param {Job} now @param {RigOrders} orders */
function progress({ state, progress }, orders) {
  const { note = "", done = 0, total = 0 } = progress ?? {};
  return [
    html`<p class="state running" role="status">
      <span class="spinner" aria-hidden="true"></span>
      ${`${sentence(note || "waiting for its turn")} ${total ? `${done} of ${total}` : ""}`}
      ${textButton("Cancel", () => orders.cancelTest(), { disabled: state === "cancelling" })}
    </p>`,
  ];
}

/** @param {TriggerTestDocument | null} found */
function verdictsOf(found) {
  if (!found) return [nothing("Not read yet.")];
  return [
    html`<ul class="verdicts">${found.eyes.map(eyeRow)}</ul>`,
    found.created_utc &&
      html`<p class="why">
        Tested ${dayTime(found.created_utc)}
      </p>`,
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
  return html`<li data-eye=${eye}>
    <span class="name eye-${eye}">${eye === "left" ? "Left" : "Right"}</span>
    ${badge(tone, text, meaning)}
    ${verdict !== "untested" && html`<p class="lead">${sentence(detail)}</p>`}
    ${times && html`<p class="why number">${times}</p>`}
  </li>`;
}

function meanings() {
  return html`<details>
    <summary>What each verdict means</summary>
    <dl class="meanings">
      ${Object.values(VERDICTS).flatMap(({ text, tone, meaning }) => [
        html`<dt>${badge(tone, text)}</dt>`,
        html`<dd>${meaning}</dd>`,
      ])}
    </dl>
  </details>`;
}
