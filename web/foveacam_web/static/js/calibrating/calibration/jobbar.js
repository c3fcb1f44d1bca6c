// Shows the running procedure: step, progress, time left, cancel; after its end the result, the reason and the remedy.

import { ACCEPTANCE_ADDRESS } from "../../addresses.js";
import { fill, h, html, setText } from "../../elements/dom.js";
import { pixels, remedyOf, sentence, timeLeft } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { knockWords } from "./fit/knocks.js";
import { bar, keptButton, shareOf } from "../../elements/parts.js";
import { isRunning, placeOf } from "./state.js";

/**
 * @import { Store, Work } from "#console"
 * @import { CalibrationOrders } from "./orders.js"
 * @import { WorkFollower } from "./work.js"
 */

const NAMES = Object.freeze(
  /** @type {Record<string, string>} */ ({
    wide: "Wide camera",
    lens: "Lens of a fovea",
    mirrors: "Mirrors",
    fit: "Fit",
    check: "Check",
    settle: "Settle times",
    all: "Everything",
    drift: "Drift check",
    acceptance: "Acceptance",
    activate: "Taking it into use",
  }),
);
const RESUMABLE = new Set(["wide", "lens", "mirrors", "all"]);

/**
 * @param {HTMLElement} place
 * @param {{store: Store, orders: CalibrationOrders, work: WorkFollower, reader: import("./reader.js").CalibrationReader}} context
 */
export function mountJobBar(place, { store, orders, work: follower, reader }) {
  const status = h("div", { class: "unseen", "aria-live": "polite" });
  const shown = h("div", { class: "job" });
  const stop = keptButton("Cancel", () => orders.cancel());
  const onward = keptButton("Go on", () => store.state.work && void orders.goOn(store.state.work), {
    kind: "plain primary",
  });
  const elsewhere = keptButton("Show its measurement", () => reader.openSession(store.state.work?.session_id ?? ""));
  const dismiss = h(
    "button",
    { type: "button", class: "tool", "aria-label": "Dismiss", on: { click: () => follower.dismiss() } },
    icon("close"),
  );
  const words = h("div", { class: "words" });
  const progress = h("div", { class: "progress" });
  fill(shown, words, progress, elsewhere, onward, stop, dismiss);
  fill(place, shown, status);
  store.on(["work", "session", "rig"], ({ work, session, rig }) => {
    shown.hidden = work === null;
    if (!work) return;
    const running = isRunning(work);
    shown.className = `job ${running ? "running" : toneOf(work)}`;
    fill(words, ...(running ? runningWords(work) : endedWords(work, { session, rig })));
    fill(progress, running && bar(nameOf(work), { share: shareOf(work), text: far(work) }));
    progress.hidden = !running;
    stop.hidden = !running;
    stop.disabled = work.state === "cancelling";
    dismiss.hidden = running;
    onward.hidden = running || !canGoOn(work);
    elsewhere.hidden = !work.session_id || !session || session.id === work.session_id;
    setText(status, announcement(work));
  });
}

/** @param {Work} work */
function nameOf({ step, stage }) {
  const name = NAMES[stage] ?? stage;
  return step === "all" && stage !== "all" ? `Everything: ${name.toLowerCase()}` : name;
}

/** @param {Work} work */
function far({ done, total, eta_s }) {
  if (!total || (done === 0 && total === 1)) return "";
  return [`${done} of ${total}`, timeLeft(eta_s)].filter(Boolean).join(", ");
}

/**
 * Return whether the procedure can be continued where it ended. The options of a complete calibration, or which fovea
 * it was, are unknown where another page started it.
 * @param {Work} work
 */
function canGoOn({ state, step, options }) {
  return state !== "succeeded" && RESUMABLE.has(step) && (options !== null || (step !== "all" && step !== "lens"));
}

/** @param {Work} work */
function runningWords(work) {
  const state =
    work.state === "queued"
      ? "waiting its turn"
      : work.state === "cancelling"
        ? "cancelling"
        : [placeOf(work), far(work)].filter(Boolean).join(": ");
  return [
    html`<p class="state running">
      <span class="spinner" aria-hidden="true"></span>
      ${nameOf(work)}
      <span class="far number">${state}</span>
    </p>`,
    work.note && html`<p class="note">${sentence(work.note)}</p>`,
  ];
}

/** @param {Work} work @param {Pick<import("#page").ConsoleState, "session" | "rig">} found */
function endedWords(work, found) {
  const tone = toneOf(work);
  const end = work.state === "succeeded" ? "done" : work.state === "cancelled" ? "cancelled" : "failed";
  const how = canGoOn(work)
    ? "“Go on” continues from there."
    : work.step === "lens"
      ? "“Take views” adds to it."
      : "“Calibrate everything” goes on from there.";
  const kept = work.state !== "succeeded" && RESUMABLE.has(work.step) ? `What was measured is kept. ${how}` : "";
  const { problem } = work;
  return [
    html`<p class="state ${tone}">
      ${icon(tone === "good" ? "check" : "warn")}
      ${work.state === "succeeded" ? NAMES[work.step] : nameOf(work)}: ${end}
    </p>`,
    work.state === "succeeded" && work.step === "all" && html`<p class="lead">${resultOf(found)}</p>`,
    work.state === "failed" && html`<p class="lead">${sentence(problem?.detail) || "The server did not say why."}</p>`,
    work.state === "failed" && remedyOf(problem) && html`<p class="remedy">${remedyOf(problem)}</p>`,
    kept && html`<p class="lead">${kept}</p>`,
    work.step === "acceptance" && acceptanceEnd(work),
  ];
}

/** @param {Work} work of an acceptance run */
function acceptanceEnd({ state }) {
  if (state === "cancelled") return html`<p class="lead">The checks made until then are kept.</p>`;
  return state === "succeeded" && html`<p class="lead"><a href=${ACCEPTANCE_ADDRESS}>See its result.</a></p>`;
}

/**
 * Word the result of a complete calibration: its errors, and whether it is in use.
 * @param {Pick<import("#page").ConsoleState, "session" | "rig">} found
 */
function resultOf({ session, rig }) {
  const check = session?.check;
  const newest = session?.calibrations.at(-1);
  const figures = check
    ? `Rows apart ${pixels(check.epipolar_rms_px)}, pointing ${pixels(check.pointing_rms_px)}, both RMS. `
    : "";
  if (!newest) return figures;
  const knocked = knockWords(session?.fit?.drift);
  return (
    figures +
    (knocked && `${knocked} `) +
    (rig?.calibration?.id === newest
      ? "It is in use."
      : "It is not in use yet: take it from the records in the overview.")
  );
}

/** @param {Work} work */
function toneOf({ state }) {
  return state === "succeeded" ? "good" : state === "cancelled" ? "warn" : "bad";
}

/** Return the text for screen readers: each step and each quarter of it, not every pose. @param {Work} work */
function announcement(work) {
  if (!isRunning(work)) return `${nameOf(work)}: ${work.state}. ${sentence(work.problem?.detail)}`;
  const share = shareOf(work);
  return `${nameOf(work)}${share === null ? "" : `: ${Math.floor(share * 4) * 25} %`}`;
}
