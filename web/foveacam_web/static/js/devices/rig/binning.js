// Shows and sets the working binning of the rig that is open, and how long the cameras took to switch it.

import { changing, fill, h, html } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { nothing, textButton } from "../../elements/parts.js";
import { binningText } from "../../video/resolution.js";
import { binningWords } from "./words.js";

/**
 * @import { CameraDocument, RigBinningDocument } from "#api"
 * @import { Store } from "#console"
 * @import { RigOrders } from "./orders.js"
 * @typedef {{
 *   binning: RigBinningDocument | null, sensor: Pick<CameraDocument, "width" | "height"> | null, refusal: string,
 *   busy: boolean
 * }} Shown
 */

const CHOICES = /** @type {const} */ ([1, 2]);

/** @param {HTMLElement} place @param {{store: Store, orders: RigOrders}} context */
export function mountBinning(place, { store, orders }) {
  let [refusal, busy] = ["", false];
  const now = h("div", { class: "stack" });
  fill(place, now);
  const choose = async (/** @type {1 | 2} */ binning) => {
    [refusal, busy] = ["", true];
    show();
    refusal = (await orders.chooseBinning(binning)) ?? "";
    busy = false;
    show();
  };
  const render = changing(now, (/** @type {Shown} */ shown) => binningOf(shown, choose));
  const show = () => {
    const { rig } = store.state;
    const camera = rig?.cameras.find(({ role }) => role === "wide");
    const sensor = camera?.width ? { width: camera.width, height: camera.height } : null;
    render({ binning: rig?.binning ?? null, sensor, refusal, busy });
  };
  store.on(["rig", "rig_page"], ({ rig_page }) => rig_page && show());
}

/** @param {Shown} shown @param {(binning: 1 | 2) => Promise<void>} choose */
function binningOf({ binning, sensor, refusal, busy }, choose) {
  if (!binning) return [nothing("Not known: the rig is not open yet.")];
  const { size, cost, held, problem } = binningWords(binning, sensor);
  return [
    html`<div class="actions binnings" role="group" aria-label="Working binning">
      ${CHOICES.map((each) =>
        textButton(binningText(each), () => choose(each), {
          disabled: busy,
          pressed: each === binning.working_binning,
        }),
      )}
    </div>`,
    html`<p class="lead">${size}</p>`,
    held && html`<p class="state warn" role="status">${held}</p>`,
    problem && html`<p class="refused" role="status">${problem}</p>`,
    refusal && html`<p class="refused" role="alert">${sentence(refusal)}</p>`,
    html`<p class="why number" data-role="switch">
      ${busy ? "Switching …" : cost}
    </p>`,
  ];
}
