// What runs now: which step, how far, how long still, cancel. When it has ended: how, why, and what to do.

import { fill, h, say } from "../dom.js";
import { sentence, span } from "../format.js";
import { icon } from "../icons.js";
import { bar } from "./parts.js";
import { isRunning } from "./work.js";

/**
 * @typedef {import("../store.js").Store} Store
 * @typedef {import("./documents.js").Work} Work
 * @typedef {import("./orders.js").CalibrationOrders} CalibrationOrders
 * @typedef {import("./work.js").WorkFollower} WorkFollower
 */

const STAGES = Object.freeze(/** @type {Record<string, string>} */ ({
  wide: "Wide camera", mirrors: "Mirrors", fit: "Fit", check: "Check", settle: "Settle times", all: "Everything", drift: "Drift check", activate: "Taking it into use",
}));
const RESUMABLE = new Set(["wide", "mirrors", "all"]);

/**
 * @param {HTMLElement} place
 * @param {{store: Store, orders: CalibrationOrders, work: WorkFollower}} context
 */
export function mountJobBar(place, { store, orders, work: follower }) {
  const said = h("div", { class: "unseen", "aria-live": "polite" });
  const shown = h("div", { class: "job" });
  const stop = h("button", { type: "button", class: "plain", on: { click: () => void orders.cancel() } }, "Cancel");
  const dismiss = h("button", { type: "button", class: "tool", "aria-label": "Dismiss", on: { click: () => follower.dismiss() } }, icon("close"));
  const words = h("div", { class: "words" });
  const progress = h("div", { class: "progress" });
  fill(shown, words, progress, stop, dismiss);
  fill(place, shown, said);
  store.on(["work"], ({ work }) => {
    shown.hidden = work === null;
    if (!work) return;
    const running = isRunning(work);
    shown.className = `job ${running ? "running" : toneOf(work)}`;
    fill(words, ...(running ? runningWords(work) : endedWords(work)));
    fill(progress, running && bar(nameOf(work), { share: shareOf(work), text: far(work) }));
    progress.hidden = !running;
    stop.hidden = !running;
    stop.disabled = work.state === "cancelling";
    dismiss.hidden = running;
    say(said, announcement(work));
  });
}

/** @param {Work} work */
function nameOf({ step, stage }) {
  const name = STAGES[stage] ?? stage;
  return step === "all" && stage !== "all" ? `Everything: ${name.toLowerCase()}` : name;
}

/**
 * How far it is; null while nothing of it is done, when nobody can tell.
 * @param {Work} work
 */
function shareOf({ done, total }) {
  return total && done > 0 ? done / total : null;
}

/** @param {Work} work */
function far({ done, total, eta_s }) {
  const left = eta_s === null || eta_s === undefined ? "" : `, ${span(eta_s)} left`;
  return total ? `${done} of ${total}${left}` : "";
}

/** @param {Work} work */
function runningWords(work) {
  const state = work.state === "queued" ? "waiting its turn" : work.state === "cancelling" ? "cancelling" : far(work);
  return [
    h("p", { class: "state running" }, h("span", { class: "spinner", "aria-hidden": "true" }), nameOf(work), h("span", { class: "far number", text: state })),
    work.note && h("p", { class: "note", text: sentence(work.note) }),
  ];
}

/** @param {Work} work */
function endedWords(work) {
  const tone = toneOf(work);
  const end = work.state === "succeeded" ? "done" : work.state === "cancelled" ? "cancelled" : "failed";
  const kept = work.state === "cancelled" && RESUMABLE.has(work.step) ? "What was measured is kept: start the step again and it goes on from there." : "";
  const { problem } = work;
  return [
    h("p", { class: `state ${tone}` }, icon(tone === "good" ? "check" : "warn"), `${nameOf(work)}: ${end}`),
    work.state === "failed" && h("p", { class: "lead", text: sentence(problem?.detail) || "The server did not say why." }),
    work.state === "failed" && problem?.remedy && !problem.detail.includes(problem.remedy) && h("p", { class: "remedy", text: sentence(problem.remedy) }),
    kept && h("p", { class: "lead", text: kept }),
  ];
}

/** @param {Work} work */
function toneOf({ state }) {
  return state === "succeeded" ? "good" : state === "cancelled" ? "warn" : "bad";
}

/**
 * What screen readers hear: each step and each quarter of it, not every pose.
 * @param {Work} work
 */
function announcement(work) {
  if (!isRunning(work)) return `${nameOf(work)}: ${work.state}. ${sentence(work.problem?.detail)}`;
  const share = shareOf(work);
  return `${nameOf(work)}${share === null ? "" : `: ${Math.floor(share * 4) * 25} %`}`;
}
