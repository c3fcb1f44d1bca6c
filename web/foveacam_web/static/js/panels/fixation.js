// Shows the fixation: while it runs its steps, then distance, error, final state and reason.

import { answerOf, basisMeaning, basisOf, basisWords, boundText, chosenOf, heading } from "../looking/answers.js";
import { spoken, spokenEstimate } from "../looking/answers.js";
import { request } from "../transport/api.js";
import { changing, fill, h, html, setText } from "../elements/dom.js";
import { angle, distance, millis, MISSING, number, remedyOf, sentence } from "../elements/format.js";
import { icon } from "../elements/icons.js";
import { hasEnded } from "../transport/jobs.js";
import { computedBy } from "../video/depth_words.js";
import { ofLook, sizeText } from "../video/resolution.js";
import { alternatives, nearerOrFarther } from "./corrections.js";
import { largerLook } from "./full_resolution.js";
import { showSteps } from "./stepplot.js";
import { API } from "../root.js";
import { textButton } from "../elements/parts.js";

/**
 * @import { CloudDocument, FixationDocument, FixationEstimate, FixationRequest } from "#api"
 * @import { Commands, ConsoleState, CurrentFixation, FullLook, Store } from "#console"
 * @import { FollowOrders } from "../looking/follow/orders.js"
 * @import { FullResolution } from "./full_resolution.js"
 * @typedef {{commands: Commands, follows: FollowOrders, full: FullResolution, measure: () => void}} Orders `measure`: take the tool
 * @typedef {{fixation_id: string, size: string, look: FullLook | null}} MoreToSee
 */

const RUNNING = Object.freeze(
  /** @type {Record<string, string>} */ ({
    sending: "Sending",
    queued: "Waiting its turn",
    running: "Verging",
    cancelling: "Cancelling",
  }),
);

/** @param {HTMLElement} place @param {HTMLElement} announcer @param {{store: Store} & Orders} context */
export function mountFixation(place, announcer, { store, ...orders }) {
  const head = h("div", { class: "outcome" });
  const plot = h("div", { class: "step-plot" });
  const figures = h("div", {});
  const full = h("div", { class: "outcome" });
  const details = h("details", { class: "details", hidden: true }, html`<summary>Details</summary>`, figures, plot);
  fill(place, head, full, details);
  const showOutcome = outcomes(head, orders);
  const showFigures = changing(figures, (/** @type {FixationDocument | null} */ fixation) => [
    fixation && numbers(fixation),
  ]);
  const announcement = announcements();
  const showFull = changing(full, (/** @type {MoreToSee | null} */ more) =>
    more ? fullResolution(more, orders.full) : [],
  );
  store.on(["current", "rig", "clouds", "full_look"], (state) => showFull(moreToSee(state)));
  store.on(["current"], ({ current }) => {
    place.dataset["state"] = current?.fixation?.state ?? current?.state ?? "none";
    place.dataset["basis"] = (current?.fixation && basisOf(current.fixation)) ?? "";
    place.dataset["job"] = current?.job_id ?? "";
    place.dataset["fixation"] = current?.fixation?.id ?? "";
    showOutcome(current);
    const steps = current?.steps ?? [];
    details.hidden = !current?.fixation && steps.length === 0;
    showFigures(current?.fixation ?? null);
    showSteps(plot, steps);
    setText(announcer, announcement(current));
  });
}

/**
 * Return what one more look would show, or is showing, of the fixation on the card; null where nothing.
 * @param {ConsoleState} state
 * @returns {MoreToSee | null}
 */
function moreToSee(state) {
  const fixation = state.current?.fixation;
  const larger = fixation && largerLook(state, fixation);
  if (!fixation || !larger) return null;
  const look = state.full_look?.fixation_id === fixation.id ? state.full_look : null;
  return { fixation_id: fixation.id, size: sizeText(larger.width, larger.height), look };
}

/** @param {MoreToSee} more @param {FullResolution} full */
function fullResolution({ fixation_id, size, look }, full) {
  if (look && !hasEnded(look.state))
    return [
      html`<p class="state running" role="status">
        <span class="spinner" aria-hidden="true"></span>
        ${sentence(look.note || "waiting its turn")}
        ${textButton("Cancel", () => full.cancel(), { disabled: look.state === "cancelling" || !look.job_id })}
      </p>`,
    ];
  return [
    look?.problem &&
      html`<p class="remedy" role="alert">${sentence(look.problem.detail)} ${remedyOf(look.problem)}</p>`,
    html`<p class="correct">
      ${textButton("Full resolution", () => full.look(fixation_id), {
        picture: "expand",
        title: `One more look at ${size}: cloud and depth with every pixel; the distance stays`,
      })}
    </p>`,
  ];
}

/**
 * Return a function that shows a fixation in parts, so that a button being pressed stays while another part changes.
 * @param {HTMLElement} head
 * @param {Orders} orders
 * @returns {(current: CurrentFixation | null) => void}
 */
function outcomes(head, orders) {
  const run = running(orders.commands);
  const [end, files] = [h("div", { class: "part" }), h("div", { class: "part" })];
  const showEnd = changing(end, (/** @type {CurrentFixation | null} */ current) =>
    current?.fixation ? ended(current.fixation, orders) : otherwise(current),
  );
  const showFiles = changing(files, (/** @type {string | null} */ cloud_id) => [
    cloud_id && uses(cloud_id, orders.measure),
  ]);
  fill(head, run.element, end, files);
  return (current) => {
    const fixation = current?.fixation ?? null;
    const runs = current !== null && !fixation && current.state !== "failed" && current.state !== "cancelled";
    run.element.hidden = !runs;
    end.hidden = runs;
    if (runs) run.show(current);
    else showEnd(current && { ...current, fixation: fixation && { ...fixation, cloud_id: null } }); // the files follow later
    showFiles(fixation?.cloud_id ?? null);
  };
}

/** @param {CurrentFixation | null} current */
function otherwise(current) {
  if (current?.state === "failed") return failed(current);
  if (current) return [title("warn", "Cancelled"), html`<p class="lead">The mirrors stay where they were.</p>`];
  return [
    html`<p class="big quiet">${MISSING}</p>`,
    html`<p class="lead">
      Click on something in the wide view: both foveae look at it, and its distance appears here.
    </p>`,
  ];
}

/** @param {Commands} commands */
function running(commands) {
  const state = h("span", {});
  const far = estimated();
  const note = h("p", { class: "lead number" });
  const cancel = h(
    "button",
    { type: "button", class: "plain", on: { click: () => void commands.cancel() } },
    "Cancel ",
    html`<kbd>Esc</kbd>`,
  );
  const element = h(
    "div",
    { class: "part" },
    html`<p class="state running"><span class="spinner" aria-hidden="true"></span>${state}</p>`,
    far.element,
    note,
    cancel,
  );
  return {
    element,
    show: (/** @type {CurrentFixation} */ current) => {
      const last = current.steps.at(-1);
      const residual = last && last.residual_x_px !== null ? `${number(Math.abs(last.residual_x_px), 2)} px apart` : "";
      setText(state, RUNNING[current.state] ?? current.state);
      far.show(current.estimate);
      const known = current.estimate?.basis ? `so far: ${basisWords(current.estimate.basis)}` : "";
      setText(
        note,
        [known, last && `step ${last.index + 1}`, last?.phase, residual || current.note].filter(Boolean).join(", ") ||
          asked(current.request),
      );
      cancel.disabled = current.state === "cancelling" || !current.job_id;
    },
  };
}

/** The distance as it is known so far, in the place of the answer's; a dash keeps that place until then. */
function estimated() {
  const [value, sigma, unit] = ["value", "sigma", "unit"].map((part) => h("span", { class: part }));
  const element = h("p", { class: "big estimate", data: { role: "estimate" } }, value, sigma, unit);
  return {
    element,
    show: (/** @type {FixationEstimate | null} */ estimate) => {
      const found = distance(estimate?.distance_m, estimate?.distance_sigma_m);
      element.classList.toggle("quiet", estimate?.distance_m == null);
      if (value) setText(value, found.value);
      if (sigma) setText(sigma, found.sigma && ` ± ${found.sigma}`);
      if (unit) setText(unit, found.unit && ` ${found.unit}`);
    },
  };
}

/** @param {CurrentFixation} current */
function failed({ problem }) {
  const remedy = remedyOf(problem);
  return [
    title("bad", problem?.title ?? "Failed"),
    html`<p class="lead">${sentence(problem?.detail) || "The server did not say why."}</p>`,
    remedy && html`<p class="remedy">${remedy}</p>`,
  ];
}

/** @param {FixationDocument} fixation @param {Orders} orders */
function ended(fixation, { commands, follows }) {
  const end = heading(fixation);
  const answer = answerOf(fixation);
  const basis = basisOf(fixation);
  const chosen = chosenOf(fixation) !== null;
  const why = reasonBeside(fixation);
  return [
    html`<div class="heading">
      ${title(end.tone, end.title, basis ? basisMeaning(basis) : "")} ${followButton(fixation, follows)}
    </div>`,
    answer.distance_m !== null
      ? far(answer)
      : answer.bound
        ? html`<p class="big limits" data-role="bound">${boundText(answer.bound)}</p>`
        : null,
    alternatives(fixation, commands),
    why && !chosen ? html`<p class="lead">${why}</p>` : null,
    !end.hint || (!basis && fixation.reason.length > 60) ? null : html`<p class="remedy">${end.hint}</p>`,
    nearerOrFarther(fixation, commands),
  ];
}

/** Return the reason without the limits that are shown above it already. @param {FixationDocument} fixation */
function reasonBeside({ reason, bound }) {
  const limits = bound ? `${sentence(boundText(bound))}` : "";
  const whole = sentence(reason);
  return limits && whole.startsWith(limits) ? whole.slice(limits.length).trim() : whole;
}

/** @param {import("../looking/answers.js").Answer} answer */
function far({ distance_m, distance_sigma_m }) {
  const { value, sigma, unit } = distance(distance_m, distance_sigma_m);
  return html`<p class="big" data-role="distance">
    <span class="value">${value}</span>
    ${sigma && html`<span class="sigma"> ± ${sigma}</span>`}
    <span class="unit"> ${unit}</span>
  </p>`;
}

/** @param {FixationDocument} fixation @param {FollowOrders} follows */
function followButton({ target_id }, follows) {
  if (target_id === null) return null;
  return textButton("Follow", () => follows.follow({ target_id }), {
    kind: "tool follow-it",
    picture: "follow",
    title: "Keep both foveae on it while it moves",
  });
}

/** @param {FixationDocument} fixation */
function numbers(fixation) {
  const chosen = chosenOf(fixation);
  const [x, y, z] = (chosen ?? fixation).point_rig_m ?? [null, null, null];
  const random_m = chosen ? null : fixation.distance_sigma_random_m;
  const verge = fixation.steps.at(-1);
  /** @type {[string, string][]} */
  const rows = [
    ["Residual", fixation.residual_px === null ? MISSING : `${number(fixation.residual_px, 2)} px`],
    ["Score", number(fixation.score, 3)],
    ["Repeatability", random_m == null ? MISSING : `± ${number(1e3 * random_m, random_m < 0.01 ? 2 : 0)} mm`],
    ["Steps", `${fixation.steps.length} in ${millis(fixation.duration_ms)}`],
    ["Vergence", verge ? angle(verge.left_ax_deg - verge.right_ax_deg, 3) : MISSING],
    ["Direction", `${angle(fixation.target.ax_deg)} ${angle(fixation.target.ay_deg)}`],
    ["Point x y z", x === null ? MISSING : `${number(x, 3)}  ${number(y, 3)}  ${number(z, 3)} m`],
  ];
  return html`<dl class="numbers">
    ${rows.flatMap(([name, text]) => [html`<dt>${name}</dt>`, html`<dd class="number">${text}</dd>`])}
  </dl>`;
}

/**
 * Return what can be done with the shape of what was looked at.
 * @param {string} cloud_id
 * @param {() => void} measure
 */
function uses(cloud_id, measure) {
  const link = (/** @type {string} */ name, /** @type {string} */ path, /** @type {string} */ what) =>
    html`<a class="plain" href="${API}/clouds/${cloud_id}${path}" download="" title=${what}>${icon("down")}${name}</a>`;
  const by = h("p", { class: "note" });
  void request("GET", `/clouds/${cloud_id}`)
    .then((found) => {
      const cloud = /** @type {CloudDocument} */ (found);
      by.textContent = `Depth by ${computedBy(cloud.backend, cloud.network_sha256)}${ofLook(cloud)}`;
    })
    .catch(() => {}); // the cloud was deleted meanwhile: its links say so
  return html`<p class="downloads">
      ${textButton("Measure", measure, { picture: "ruler", title: "Lengths and planes on what was looked at (M)" })}
      ${link("PLY", ".ply", "Point cloud with colour and standard error")}
      ${link("GLB", ".glb", "Textured depth mesh")}
      ${link("Depth picture", "/depth.png", "Colour-coded depth")}
    </p>
    ${by}`;
}

/** @param {string} tone @param {string} text @param {string} [meaning] */
function title(tone, text, meaning = "") {
  return html`<p class="state ${tone}" title=${meaning}>
    ${icon(tone === "good" ? "check" : tone === "plain" ? "info" : "warn")}
    ${text}
  </p>`;
}

/** @param {FixationRequest | null} request */
function asked(request) {
  if (!request) return "";
  if (request.pixel) return `pixel ${number(request.pixel.x_px, 1)}, ${number(request.pixel.y_px, 1)}`;
  if (request.direction) return `direction ${angle(request.direction.ax_deg)} ${angle(request.direction.ay_deg)}`;
  if (!request.rectangle) return "";
  const { x_px, y_px, width_px, height_px } = request.rectangle;
  return `${number(width_px, 0)} × ${number(height_px, 0)} px at ${number(x_px, 0)}, ${number(y_px, 0)}`;
}

/** Return a function that words the announcements for screen readers: only a fixation's first estimate is announced. */
function announcements() {
  let [job_id, first] = /** @type {[string | null, string]} */ ([null, ""]);
  return (/** @type {CurrentFixation | null} */ current) => {
    if (current?.job_id !== job_id) [job_id, first] = [current?.job_id ?? null, ""];
    if (current?.fixation) return spoken(current.fixation);
    if (current?.state === "failed") return `Failed. ${current.problem?.detail ?? ""}`;
    if (current?.state === "cancelled") return "Cancelled.";
    if (current?.estimate) first ||= spokenEstimate(current.estimate);
    return first;
  };
}
