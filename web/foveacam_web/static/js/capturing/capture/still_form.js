// Fields for the next still: cameras, number of frames, what is stored of them, and whether to review it before
// storing.

import { allHold, numberField, tickField } from "../../elements/parts.js";
import { h, html } from "../../elements/dom.js";
import { asked, segments, textField } from "./parts.js";
import { CAMERAS } from "./still_words.js";

/**
 * @import { StillRequest } from "#api"
 * @import { Role } from "#page"
 */

const MOST_FRAMES = 64;
const USUAL_FRAMES = 5;
const ROLES = /** @type {Role[]} */ (["wide", "left", "right"]);

/** @returns {{element: HTMLElement, read: () => StillRequest | null}} `read`: null, and the field is shown, when one cannot be used */
export function makeStillForm() {
  const frames = numberField("Frames", { value: USUAL_FRAMES, min: 1, max: MOST_FRAMES });
  const keep = segments("Kept of a stack", [
    ["mean", "Mean, 16 bits"],
    ["all", "Every frame"],
  ]);
  const cameras = ROLES.map((role) => /** @type {const} */ ([role, tickField(CAMERAS[role], true)]));
  const name = textField("Name", { placeholder: "by date and time" });
  const label = textField("Label", { placeholder: "what it shows" });
  const save = tickField("Keep it at once, without looking", false);
  const chosen = () => cameras.filter(([, { value }]) => value()).map(([role]) => role);
  const mark = () => cameras[0]?.[1].input.setCustomValidity(chosen().length > 0 ? "" : "Choose a camera.");
  const element = h(
    "div",
    { class: "stack still-form", on: { change: mark } },
    asked([frames.element, keep.element]),
    html`<div class="fields" role="group" aria-label="Cameras">
      ${cameras.map(([, { element: tick }]) => tick)}
    </div>`,
    asked([name.element, label.element]),
    save.element,
  );
  const read = () => {
    const first = cameras[0]?.[1].input;
    if (!allHold(frames) || frames.value() === null || (first && !first.reportValidity())) return null;
    return {
      stack_frames: frames.value() ?? USUAL_FRAMES,
      stack_keep: keep.value(),
      cameras: chosen(),
      name: name.value().trim() || null,
      label: label.value().trim(),
      save: save.value(),
    };
  };
  return { element, read };
}
