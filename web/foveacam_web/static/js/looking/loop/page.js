// Builds the page of the vergence loop: panes, status, axes, plots, settings, tuning, trigger, match.

import "../../elements/plot.js";
import { fill, h, html, update } from "../../elements/dom.js";
import { icon } from "../../elements/icons.js";
import { pageHead } from "../../pages.js";
import { badge, figures, panel, textButton } from "../../elements/parts.js";
import { AxisControl } from "./axis.js";
import { matchPicture } from "./match.js";
import { distancePlot, errorPlot, SPAN_S } from "./plots.js";
import { mountSettings } from "./settings_panel.js";
import { tuningParts } from "./tuning.js";
import { AXES, detailOf, distanceOf, figuresOf, STATUSES, triggerFigures } from "./words.js";
import { waiting } from "../../elements/waiting.js";

/**
 * @import { LoopDocument, LoopSample, LoopTriggerDocument } from "#api"
 * @import { Role, Store } from "#console"
 * @import { Slots } from "../../pages.js"
 * @import { LoopOrders } from "./orders.js"
 */

/** @param {HTMLElement} place @param {{store: Store, orders: LoopOrders}} context @returns {Slots} */
export function mountLoopPage(place, { store, orders }) {
  /** @type {Role[]} */
  const roles = ["wide", "left", "right"];
  const places = new Map(roles.map((role) => [role, h("div", { class: `lent lent-${role}` })]));
  const stack = () => h("div", { class: "stack" });
  const [status, plots, tuning, trigger, settings] = [stack(), stack(), stack(), stack(), stack()];
  const axes = AXES.map((about) => ({ axis: about.axis, control: new AxisControl(about, orders) }));
  const showSettings = mountSettings(settings, { orders, settings: () => store.state.loop?.settings ?? null });
  fill(
    place,
    pageHead("loop-title", "Vergence loop"),
    html`<div class="loop-body">
      <div class="column loop-see">
        ${places.get("wide") ?? null}
        <p class="lead">
          Click in the wide view to choose the target. While the loop runs, Alt and drag steers the eyes by hand; the loop
          resumes on release. A click in the picture of one eye lets that eye follow the clicked point independently.
        </p>
        <div class="capture-eyes">${places.get("left") ?? null}${places.get("right") ?? null}</div>
      </div>
      <div class="column">
        ${panel("Status", status)} ${panel("Trigger", trigger)}
        ${panel("Axes", ...axes.map(({ control }) => control.element))}
        ${panel(`The last ${SPAN_S} s`, plots)}
        ${matchPicture(store)}
        ${panel("Tuning", tuning)}
        ${panel("Settings", settings)}
      </div>
    </div>`,
  );
  store.on(["loop", "loop_page", "rig"], (state) => {
    const { loop } = state;
    if (!state.loop_page) return;
    update(status, loop ? statusParts(loop, orders) : waiting("Loading the loop"));
    if (!loop) return;
    update(trigger, triggerParts(loop.trigger, orders));
    const now = {
      open: loop.running && loop.tune_job_id === null && loop.eyes.length === 0,
      baseline_m: state.rig?.calibration?.baseline_m ?? 0,
    };
    for (const { axis, control } of axes) {
      const found = loop.axes.find((each) => each.axis === axis);
      if (found) control.show(found, now);
    }
    showSettings(loop.settings, loop.tune_job_id === null);
  });
  store.on(["loop", "loop_page", "loop_tuning", "tune_refusal"], (state) => {
    if (state.loop_page) update(tuning, tuningParts(state, orders));
  });
  store.on(["loop_samples", "loop_page"], ({ loop_page, loop_samples }) => {
    if (loop_page) update(plots, plotParts(loop_samples));
  });
  return places;
}

/** @param {LoopDocument} loop @param {LoopOrders} orders */
function statusParts(loop, orders) {
  const { tone, text } = STATUSES[loop.status];
  const { running, paused, dragged, eyes } = loop;
  return html`<div class="loop-status" data-status=${loop.status}>
      <p class="loop-word" role="status">${badge(tone, text)}</p>
      <p class="distance number">${distanceOf(loop)}</p>
      <div class="actions">
        ${textButton(paused ? "Go on" : "Pause", () => orders.togglePause(), {
          kind: "plain pause",
          picture: paused ? "play" : "pause",
          title: "Suspend the corrections, or resume them (P)",
          disabled: !running || eyes.length > 0,
        })}
        ${textButton("End", () => orders.end(), {
          kind: "plain end",
          picture: "close",
          title: "End the loop; the mirrors stay where they are",
          disabled: !running,
        })}
        ${
          eyes.length > 0 &&
          textButton("Unite the eyes", () => orders.uniteEyes(), {
            kind: "plain unite",
            title: "Let both eyes look at one target again",
          })
        }
        ${dragged && textButton("Let the loop go on", () => orders.release())}
      </div>
    </div>
    <p class="lead detail">${detailOf(loop)}</p>
    ${figures(figuresOf(loop))}`;
}

/** @param {LoopTriggerDocument} trigger @param {LoopOrders} orders */
function triggerParts(trigger, orders) {
  return html`${
    trigger.latched &&
    html`<div class="strip warn" role="alert">
        ${icon("warn")}
        <div><strong>The loop waits: exposures fail repeatedly. </strong>${trigger.reason}</div>
        ${textButton("Reset trigger", () => orders.resetTrigger())}
      </div>`
  }
    ${figures(triggerFigures(trigger))}`;
}

/** @param {LoopSample[]} samples */
function plotParts(samples) {
  const plots = [errorPlot(samples), distancePlot(samples)].filter(({ curves }) =>
    curves.some(({ runs }) => runs.length),
  );
  if (plots.length === 0) return html`<p class="empty">Errors and distance over time appear here.</p>`;
  return html`<div class="loop-plots">${plots.map((spec) => html`<value-plot .spec=${spec}></value-plot>`)}</div>`;
}
