// The top bar: rig, state, health of the calibration, holder of the lease, and the stop button.

import { ACCEPTANCE_ADDRESS, CAPTURE_ADDRESS, SETUP_ADDRESS, wizardAddress } from "../addresses.js";
import { healthReason, verdictOf } from "../calibrating/calibration/verdict.js";
import { isRunning, placeOf } from "../calibrating/calibration/state.js";
import { isCapturing, shareOf } from "../capturing/capture/state.js";
import { farWords, stateWords } from "../capturing/capture/words.js";
import { fill, h, html, setText } from "../elements/dom.js";
import { baseline, remedyOf, sentence } from "../elements/format.js";
import { icon } from "../elements/icons.js";
import { paceOf } from "../video/pace.js";
import { leaseBadge } from "../operating/lease/words.js";

/**
 * @import { ConsoleState, Store } from "#console"
 */

const STATES = Object.freeze(
  /** @type {Record<string, {text: string, tone: string}>} */ ({
    opening: { text: "Opening", tone: "warn" },
    ready: { text: "Ready", tone: "good" },
    degraded: { text: "Degraded", tone: "warn" },
    stopped: { text: "Stopped", tone: "bad" },
  }),
);

/** Fill the badges of the top bar. @param {HTMLElement} place @param {{store: Store, openLease: () => void}} context */
export function mountBadges(place, { store, openLease }) {
  const rig = h("span", { class: "rig-name" });
  const simulated = h("span", { class: "badge plain", hidden: true, text: "Simulated" });
  const state = h("span", { class: "badge", role: "status" });
  const calibration = h("a", { class: "badge plain link", href: wizardAddress("overview") });
  const lease = h("button", { type: "button", class: "badge plain button", on: { click: openLease } });
  const capture = h("a", { class: "badge link plain mine", href: CAPTURE_ADDRESS });
  fill(place, rig, simulated, state, calibration, lease);
  shareHeight(place);
  store.on(["rig", "stream", "stop", "signed_out", "server_stats"], (now) => {
    setText(rig, now.rig ? now.rig.name : "");
    rig.title = now.rig ? `${now.rig.rig_id ?? "no rig yet"}, baseline ${baseline(now.rig.baseline_m)}` : "";
    simulated.hidden = !now.rig?.simulated;
    simulated.title = now.rig?.scene ? `Scene “${now.rig.scene}”` : "";
    showState(state, now);
  });
  store.on(["rig", "health", "work"], (now) => showCalibration(calibration, now));
  store.on(["capturing"], (now) => {
    if (!isCapturing(now.capturing)) capture.remove();
    else if (!capture.isConnected) state.after(capture);
    showCapture(capture, now);
  });
  store.on(["lease", "lease_token"], (now) => showLease(lease, now));
}

/** Tell the style sheets how high the bar is, for what stays below it. @param {HTMLElement} place in the bar */
function shareHeight(place) {
  const bar = /** @type {HTMLElement} */ (place.closest(".topbar"));
  const share = () => document.documentElement.style.setProperty("--topbar", `${bar.offsetHeight}px`);
  new ResizeObserver(share).observe(bar);
}

/** @param {HTMLElement} badge @param {ConsoleState} now */
function showState(badge, now) {
  const { rig, stream, stop, signed_out } = now;
  const pace = rig?.state === "ready" ? paceWords(now) : null;
  const word = signed_out
    ? { text: "Signed out", tone: "bad" }
    : stream === "down"
      ? { text: "Offline", tone: "bad" }
      : stop?.engaged
        ? STATES["stopped"]
        : rig
          ? (pace ?? STATES[rig.state])
          : { text: "Connecting", tone: "warn" };
  badge.className = `badge ${word?.tone ?? "warn"}`;
  setText(badge, word?.text ?? rig?.state ?? "");
  const problems = rig?.problems.map(({ device, detail }) => `${device}: ${detail}`) ?? [];
  badge.title = [...problems, pace?.title].filter(Boolean).join("\n");
}

/** Return the state of a rig that is ready, but whose live views are not; null while they are. @param {ConsoleState} now */
function paceWords(now) {
  const roles = /** @type {import("#page").Role[]} */ (["wide", "left", "right"]);
  const found = roles.flatMap((role) => {
    const pace = paceOf(now, role);
    return pace ? [{ role, pace }] : [];
  });
  if (found.length === 0) return null;
  const title = found
    .map(({ role, pace }) => `${role}: ${pace.frozen ? "no new pictures" : `${pace.text}: ${pace.reason}`}`)
    .join("\n");
  return found.some(({ pace }) => pace.frozen)
    ? { text: "Frozen", tone: "bad", title }
    : { text: "Slow", tone: "warn", title };
}

/** @param {HTMLElement} badge @param {ConsoleState} now */
function showCalibration(badge, now) {
  badge.hidden = !now.rig;
  const running = now.work && isRunning(now.work) ? now.work : null;
  const { tone, text, reason } = running ? runningWords(running) : verdictOf(now);
  badge.setAttribute("href", running?.step === "acceptance" ? ACCEPTANCE_ADDRESS : wizardAddress("overview"));
  badge.className = `badge link ${tone}`;
  setText(badge, text);
  badge.title = reason;
}

/** @param {HTMLElement} badge @param {ConsoleState} now */
function showCapture(badge, { capturing }) {
  if (!capturing) return;
  const share = shareOf(capturing);
  const waits = capturing.state === "paused" ? "Capture paused" : "Capturing";
  badge.className = `badge link ${capturing.why ? "warn" : "plain mine"}`;
  setText(badge, [waits, share === null ? "" : `${Math.floor(100 * share)} %`].filter(Boolean).join(" "));
  badge.title = sentence(
    [capturing.name, capturing.why || stateWords(capturing), farWords(capturing)].filter(Boolean).join(", "),
  );
}

/** @param {import("#page").Work} work */
function runningWords(work) {
  const { step, done, total, note } = work;
  const name = { drift: "Checking drift", acceptance: "Acceptance" }[String(step)] ?? "Calibrating";
  const far = placeOf(work) ?? (total && done > 0 ? `${Math.floor((100 * done) / total)} %` : "");
  return {
    tone: "plain mine",
    text: [name, far].filter(Boolean).join(step === "all" ? ", " : " "),
    reason: sentence(note),
  };
}

/** @param {HTMLElement} badge @param {ConsoleState} now */
function showLease(badge, { lease, lease_token }) {
  badge.classList.toggle("mine", Boolean(lease_token));
  fill(badge, icon("hand"), leaseBadge(lease, Boolean(lease_token)));
  badge.title = "Who may move the mirrors. Stopping needs no control.";
}

/**
 * Show the rig's problems, one line each with its remedy, and the advice to recalibrate.
 * @param {HTMLElement} strip
 * @param {Store} store
 */
export function mountProblems(strip, store) {
  store.on(["rig", "health"], ({ rig, health }) => {
    const problems = rig?.problems ?? [];
    const stale = rig?.calibration && health?.verdict === "recalibrate" ? health : null;
    strip.hidden = problems.length === 0 && !stale;
    fill(
      strip,
      icon("warn"),
      html`<ul>
        ${problems.map(
          (problem) =>
            html`<li>
            ${problem.detail.includes(problem.device) ? null : html`<b>${problem.device} </b>`}
            ${sentence(problem.detail)} <span class="remedy">${remedyOf(problem)}</span>
            ${problem.device === "rig" ? html`<a href=${SETUP_ADDRESS}>Set the rig up.</a>` : null}
          </li>`,
        )}
        ${
          stale &&
          html`<li>
            <b>calibration </b>
            ${healthReason(stale)} <a href=${wizardAddress("overview")}>Check its drift, or calibrate again.</a>
          </li>`
        }
      </ul>`,
    );
  });
}
