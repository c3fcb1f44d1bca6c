// The panel of stills: the options of the next still, the button, and the last still.

import { bar, keptButton, panel } from "../../elements/parts.js";
import { changing, h, html } from "../../elements/dom.js";
import { count, remedyOf, sentence } from "../../elements/format.js";
import { makeStillForm } from "./still_form.js";
import { StillOrders } from "./still_orders.js";
import { makeStillShown } from "./still_shown.js";

/**
 * @import { JobProgress, Problem } from "#api"
 * @import { Commands, Store } from "#console"
 * @import { StillReader } from "./still_reader.js"
 */

/** @param {{store: Store, commands: Commands, reader: StillReader}} context */
export function stillPanel({ store, commands, reader }) {
  const orders = new StillOrders({ commands, changed: () => reader.readHeld() });
  const [form, shown, status] = [makeStillForm(), makeStillShown(orders), h("div", { class: "stack", role: "status" })];
  const showProgress = changing(status, progressOf);
  /** The refusal of the last request, until the next one. @type {Problem | null} */
  let refused = null;
  let sending = false;
  const take = async () => {
    const wish = form.read();
    if (!wish || sending) return;
    sending = true;
    show();
    const answer = await orders.take(wish);
    sending = false;
    refused = "status" in answer ? answer : null;
    if (!("status" in answer)) reader.jobs.follow(answer);
    show();
  };
  const button = keptButton("Take a still", () => take(), { kind: "plain primary start", picture: "pictures" });
  const show = () => {
    const { jobs, held } = reader;
    button.disabled = sending || store.state.stream === "down" || jobs.running;
    shown.show(held);
    const { progress = null, problem = null } = jobs.job ?? {};
    showProgress({ running: jobs.running, progress, problem: refused ?? problem });
  };
  reader.changed = show;
  reader.taken = (still) => still.state === "kept" && orders.notifyKept(still);
  store.on(["stream"], show);
  store.on(["capture_page"], ({ capture_page }) => capture_page && void reader.readAll());
  const left = h("div", { class: "stack" }, form.element, html`<p class="actions">${button}</p>`, status);
  return panel("Still", h("div", { class: "still-panel" }, left, shown.element));
}

/** @param {{running: boolean, progress: JobProgress | null, problem: Problem | null}} now */
function progressOf({ running, progress, problem }) {
  if (running) {
    const { done = 0, total = 0 } = progress ?? {};
    const words = total > 0 ? `${count(done)} of ${count(total)} frames` : "Waiting for the rig.";
    return [
      bar("Frames taken", { share: total > 0 ? done / total : null, text: words }),
      html`<p class="why">${words}</p>`,
    ];
  }
  if (!problem) return [];
  return [html`<p class="refused" role="alert">${sentence(problem.detail)} ${remedyOf(problem)}</p>`];
}
