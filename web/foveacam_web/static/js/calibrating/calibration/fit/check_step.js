// Step 4, the check at poses that the fit has not used: pointing error over the wide picture, row error between the
// eyes.

import { changing, h, html } from "../../../elements/dom.js";
import { pixels } from "../../../elements/format.js";
import { badge, nothing, panel, starter } from "../../../elements/parts.js";
import { figure, picturesOf } from "../pictures.js";

/**
 * @import { CheckDocument, PictureDocument } from "#api"
 * @import { ConsoleState } from "#page"
 * @import { WizardContext } from "../page.js"
 */

/** @type {{key: "epipolar_rms_px" | "epipolar_p95_px" | "pointing_rms_px", name: string, goal: number, what: string}[]} */
const GOALS = [
  {
    key: "epipolar_rms_px",
    name: "Rows apart, RMS",
    goal: 0.3,
    what: "Vertical distance of the same point in both rectified eyes: stereo needs it on one row.",
  },
  {
    key: "epipolar_p95_px",
    name: "Rows apart, 95 %",
    goal: 0.8,
    what: "95 of 100 places in the field are better than this.",
  },
  {
    key: "pointing_rms_px",
    name: "Pointing, RMS",
    goal: 2,
    what: "Distance of the commanded target from the middle of the fovea.",
  },
];

const BEYOND =
  "Beyond a goal. If the map below has one colour all over, the eyes have drifted since they were measured: correct that by “Measure and correct” in the overview, and check again. If it is patchy, measure the mirrors again.";

/** @param {WizardContext} context */
export function makeCheckStep({ store, orders }) {
  const live = h("div", { class: "live-slot" });
  const result = h("div", {});
  const diagrams = h("div", { class: "diagrams" });
  const showResult = changing(result, (/** @type {{check: CheckDocument | null, old: boolean}} */ now) =>
    resultOf(now),
  );
  const showDiagrams = changing(diagrams, (/** @type {PictureDocument[]} */ pictures) =>
    pictures.length
      ? pictures.map(figure)
      : [nothing("The overlay and the map of the field appear with the first check.")],
  );
  store.on(["session"], ({ session }) => {
    showResult({ check: session?.check ?? null, old: isOld(session) });
    showDiagrams(picturesOf(session, ["overlay", "epipolar"]));
  });
  const start = starter({
    label: "Check",
    store,
    act: () => orders.run("check"),
    primary: true,
    keys: ["session"],
    why: against,
    named: ({ session }) => (session?.check ? "Check again" : "Check"),
  });
  const element = h(
    "div",
    { class: "step step-check" },
    html`<div class="seeing">
      ${panel(
        "Check",
        html`<p class="lead">
          The eyes look at places that were not in the sweep, and what the fitted model predicts is held against what
          they see.
        </p>`,
        html`<p class="actions">${start}</p>`,
        result,
      )}
      ${live}
    </div>`,
    panel("Diagrams", diagrams),
  );
  return { element, live };
}

/** @param {ConsoleState} state */
function against({ session }) {
  return session?.fit ? null : "First step 3: there is no fit to check yet.";
}

/**
 * Return whether the check was made with another calibration than the session's newest.
 * @param {ConsoleState["session"]} session
 */
function isOld(session) {
  const newest = session?.calibrations.at(-1);
  return Boolean(session?.check && newest && session.check.calibration_id !== newest);
}

/** @param {{check: CheckDocument | null, old: boolean}} now */
function resultOf({ check, old }) {
  if (!check) return [nothing("Not checked yet.")];
  return [
    old && html`<p class="remedy">Fitted again since: this check is of the previous fit. Check again.</p>`,
    html`<dl class="goals">
      ${GOALS.flatMap(({ key, name, goal, what }) => {
        const value = check[key];
        const met = value !== null && value <= goal;
        return [
          html`<dt title=${what}>${name}</dt>`,
          html`<dd>
            <span class="number">${value === null ? "not measured" : pixels(value)}</span>
            ${value === null ? null : badge(met ? "good" : "warn", `${met ? "within" : "beyond"} ${goal} px`)}
          </dd>`,
        ];
      })}
    </dl>`,
    html`<p class="legend">${check.poses} places in the field. Pixels of the fovea.</p>`,
    ...(!old && GOALS.some(({ key, goal }) => (check[key] ?? 0) > goal) ? [html`<p class="remedy">${BEYOND}</p>`] : []),
  ];
}

/** @param {ConsoleState} state */
export function checkProgress({ session }) {
  const rms_px = session?.check?.epipolar_rms_px;
  if (isOld(session)) return { tone: "warn", text: "fitted since" };
  return rms_px === null || rms_px === undefined
    ? null
    : { tone: rms_px <= 0.3 ? "good" : "warn", text: pixels(rms_px) };
}
