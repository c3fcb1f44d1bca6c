// Builds the planner's sliders: feature and resolution, distance of being noticed, obstacles.

import { choiceField, panel, tickField } from "../../elements/parts.js";
import { h } from "../../elements/dom.js";
import { Troubles } from "../../capturing/capture/parts.js";
import { BOUNDS, NAMES, NUMBERS } from "./settings.js";
import { makeSlide } from "./slide.js";

/** @import { PlanSettings, PlannerNumber, RingBound } from "#page" */

/** @param {{troubles: Troubles, changed: (part: Partial<PlanSettings>) => void}} options */
export function makeControls({ troubles, changed }) {
  const bound = choiceField(
    "D_min and its error (Eq. 9)",
    BOUNDS.map(([value, text]) => /** @type {[string, string]} */ ([value, `ΔZ ${text}`])),
    (value) => changed({ bound: /** @type {RingBound} */ (value) }),
  );
  const own = tickField("Set here; otherwise twice as wide as the ring", true);
  own.input.addEventListener("change", () => changed({ own_domain: own.input.checked }));
  const slides = new Map(
    NAMES.map((name) => [
      name,
      makeSlide(NUMBERS[name], {
        place: troubles.place(name),
        changed: (value) => changed({ [name]: value }),
        ...(name === "domain_m2" ? { below: own.element } : {}),
      }),
    ]),
  );
  const of = (/** @type {PlannerNumber[]} */ ...names) => names.map((name) => slides.get(name)?.element ?? null);
  const element = h(
    "div",
    { class: "column planner-controls" },
    panel("What is looked at", ...of("feature_mm", "px_per_deg", "pixels")),
    panel("The observer", ...of("d_min_m", "near_error_m"), bound.element, ...of("agent_radius_m")),
    panel("Random obstacles", ...of("occupancy", "radius_m", "domain_m2")),
  );
  return {
    element,
    show: (/** @type {PlanSettings} */ settings) => {
      for (const [name, slide] of slides) slide.show(settings[name]);
      bound.input.value = settings.bound;
      own.input.checked = settings.own_domain;
      slides.get("domain_m2")?.enable(settings.own_domain);
    },
  };
}
