// Shows the fixation: while it runs its steps, then distance, error, final state and reason.

import { answerOf, basisMeaning, basisOf, boundText, chosenOf, heading, spoken } from "../answers.js";
import { changing, fill, h, say } from "../dom.js";
import { angle, distance, millis, MISSING, number, remedyOf, sentence } from "../format.js";
import { icon } from "../icons.js";
import { alternatives, nearerOrFarther } from "./corrections.js";
import { drawSteps } from "./stepplot.js";

/**
 * @import { FixationDocument, FixationRequest } from "#api"
 * @import { CurrentFixation } from "#page"
 * @import { Commands } from "../commands.js"
 * @import { Store } from "../store.js"
 */

const RUNNING = Object.freeze(
  /** @type {Record<string, string>} */ ({
    sending: "Sending",
    queued: "Waiting its turn",
    running: "Verging",
    cancelling: "Cancelling",
  }),
);

/**
 * @param {HTMLElement} place
 * @param {HTMLElement} announcer
 * @param {{store: Store, commands: Commands}} context
 */
export function mountFixation(place, announcer, { store, commands }) {
  const head = h("div", { class: "outcome" });
  const plot = h("div", { class: "plot" });
  fill(place, head, plot);
  const showOutcome = outcomes(head, commands);
  store.on(["current"], ({ current }) => {
    place.dataset["state"] = current?.fixation?.state ?? current?.state ?? "none";
    place.dataset["basis"] = (current?.fixation && basisOf(current.fixation)) ?? "";
    place.dataset["fixation"] = current?.fixation?.id ?? "";
    showOutcome(current);
    if (!plot.contains(document.activeElement)) redrawSteps(plot, current);
    say(announcer, announcement(current));
  });
}

/**
 * @param {HTMLElement} plot
 * @param {CurrentFixation | null} current
 */
function redrawSteps(plot, current) {
  const open = plot.querySelector("details")?.open ?? false;
  drawSteps(plot, current?.steps ?? []);
  const details = plot.querySelector("details");
  if (details) details.open = open;
}

/**
 * Return a function that shows a fixation in parts, so that a button being pressed stays while another part changes.
 * @param {HTMLElement} head
 * @param {Commands} commands
 * @returns {(current: CurrentFixation | null) => void}
 */
function outcomes(head, commands) {
  const run = running(commands);
  const [end, files] = [h("div", { class: "part" }), h("div", { class: "part" })];
  const showEnd = changing(end, (/** @type {CurrentFixation | null} */ current) =>
    current?.fixation ? ended(current.fixation, commands) : otherwise(current),
  );
  const showFiles = changing(files, (/** @type {string | null} */ cloud_id) => [cloud_id && downloads(cloud_id)]);
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
  if (current)
    return [title("warn", "Cancelled"), h("p", { class: "lead", text: "The mirrors stay where they were." })];
  return [
    h("p", { class: "big quiet", text: MISSING }),
    h("p", {
      class: "lead",
      text: "Click on something in the wide view: both foveae look at it, and its distance appears here.",
    }),
  ];
}

/** @param {Commands} commands */
function running(commands) {
  const state = h("span", {});
  const note = h("p", { class: "lead number" });
  const cancel = h(
    "button",
    { type: "button", class: "plain", on: { click: () => void commands.cancel() } },
    "Cancel ",
    h("kbd", { text: "Esc" }),
  );
  const element = h(
    "div",
    { class: "part" },
    h("p", { class: "state running" }, h("span", { class: "spinner", "aria-hidden": "true" }), state),
    note,
    cancel,
  );
  return {
    element,
    show: (/** @type {CurrentFixation} */ current) => {
      const last = current.steps.at(-1);
      const residual = last && last.residual_x_px !== null ? `${number(Math.abs(last.residual_x_px), 2)} px apart` : "";
      say(state, RUNNING[current.state] ?? current.state);
      say(
        note,
        [last && `step ${last.index + 1}`, last?.phase, residual || current.note].filter(Boolean).join(", ") ||
          asked(current.request),
      );
      cancel.disabled = current.state === "cancelling" || !current.job_id;
    },
  };
}

/** @param {CurrentFixation} current */
function failed({ problem }) {
  const remedy = remedyOf(problem);
  return [
    title("bad", problem?.title ?? "Failed"),
    h("p", { class: "lead", text: sentence(problem?.detail) || "The server did not say why." }),
    remedy && h("p", { class: "remedy", text: remedy }),
  ];
}

/**
 * @param {FixationDocument} fixation
 * @param {Commands} commands
 */
function ended(fixation, commands) {
  const end = heading(fixation);
  const answer = answerOf(fixation);
  const basis = basisOf(fixation);
  const chosen = chosenOf(fixation) !== null;
  const why = reasonBeside(fixation);
  return [
    title(end.tone, end.title, basis ? basisMeaning(basis) : ""),
    answer.distance_m !== null
      ? far(answer)
      : answer.bound
        ? h("p", { class: "big limits", data: { role: "bound" }, text: boundText(answer.bound) })
        : null,
    alternatives(fixation, commands),
    why && !chosen ? h("p", { class: "lead", text: why }) : null,
    basis || !end.hint || fixation.reason.length > 60 ? null : h("p", { class: "remedy", text: end.hint }),
    nearerOrFarther(fixation, commands),
    numbers(fixation),
  ];
}

/**
 * Return the reason without the limits that are shown above it already.
 * @param {FixationDocument} fixation
 */
function reasonBeside({ reason, bound }) {
  const limits = bound ? `${sentence(boundText(bound))}` : "";
  const whole = sentence(reason);
  return limits && whole.startsWith(limits) ? whole.slice(limits.length).trim() : whole;
}

/** @param {import("../answers.js").Answer} answer */
function far({ distance_m, distance_sigma_m }) {
  const { value, sigma, unit } = distance(distance_m, distance_sigma_m);
  return h(
    "p",
    { class: "big", data: { role: "distance" } },
    h("span", { class: "value", text: value }),
    sigma && h("span", { class: "sigma", text: ` ± ${sigma}` }),
    h("span", { class: "unit", text: ` ${unit}` }),
  );
}

/** @param {FixationDocument} fixation */
function numbers(fixation) {
  const [x, y, z] = (chosenOf(fixation) ?? fixation).point_rig_m ?? [null, null, null];
  const verge = fixation.steps.at(-1);
  /** @type {[string, string][]} */
  const rows = [
    ["Residual", fixation.residual_px === null ? MISSING : `${number(fixation.residual_px, 2)} px`],
    ["Score", number(fixation.score, 3)],
    ["Steps", `${fixation.steps.length} in ${millis(fixation.duration_ms)}`],
    ["Vergence", verge ? angle(verge.left_ax_deg - verge.right_ax_deg, 3) : MISSING],
    ["Direction", `${angle(fixation.target.ax_deg)} ${angle(fixation.target.ay_deg)}`],
    ["Point x y z", x === null ? MISSING : `${number(x, 3)}  ${number(y, 3)}  ${number(z, 3)} m`],
  ];
  return h(
    "dl",
    { class: "numbers" },
    rows.flatMap(([name, text]) => [h("dt", { text: name }), h("dd", { class: "number", text })]),
  );
}

/** @param {string} cloud_id */
function downloads(cloud_id) {
  const link = (/** @type {string} */ name, /** @type {string} */ path, /** @type {string} */ what) =>
    h("a", { href: `/api/v1/clouds/${cloud_id}${path}`, download: "", title: what }, icon("down"), name);
  return h(
    "p",
    { class: "downloads" },
    link("PLY", ".ply", "Point cloud with colour and standard error"),
    link("GLB", ".glb", "Textured depth mesh"),
    link("Depth picture", "/depth.png", "Colour-coded depth"),
  );
}

/**
 * @param {string} tone
 * @param {string} text
 * @param {string} [meaning]
 */
function title(tone, text, meaning = "") {
  return h(
    "p",
    { class: `state ${tone}`, title: meaning },
    icon(tone === "good" ? "check" : tone === "plain" ? "info" : "warn"),
    text,
  );
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

/** @param {CurrentFixation | null} current */
function announcement(current) {
  const fixation = current?.fixation;
  if (fixation) return spoken(fixation);
  if (current?.state === "failed") return `Failed. ${current.problem?.detail ?? ""}`;
  return current?.state === "cancelled" ? "Cancelled." : "";
}
