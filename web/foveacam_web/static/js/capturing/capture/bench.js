// Connects the editor, the estimate and the start button: estimates and saves the draft, shows each refusal at its
// field.

import { focusOn, h } from "../../elements/dom.js";
import { keepDraft } from "./draft.js";
import { makeEditor } from "./editor.js";
import { Estimator } from "./estimator.js";
import { Troubles } from "./parts.js";
import { textButton } from "../../elements/parts.js";
import { planOf, viewSize } from "./plan.js";
import { makeStarter } from "./starter.js";

/**
 * @import { EstimateRequest } from "#api"
 * @import { Commands, PlanDraft, Store, ViewSize, WholeDraft } from "#console"
 */

/** The plan that is edited on the page. */
export class Bench {
  #store;
  #editor;
  #starter;
  #kept;
  #estimator;
  /** @type {ViewSize | null} */
  #view = null;

  /** @param {{store: Store, commands: Commands, orders: import("./orders.js").CaptureOrders}} context */
  constructor({ store, commands, orders }) {
    const troubles = new Troubles();
    this.#store = store;
    this.#estimator = new Estimator(store);
    this.#editor = makeEditor({ store, troubles, changed: () => this.#typed() });
    this.#starter = makeStarter({
      store,
      orders,
      troubles,
      source: () => this.#editor.read().source,
      plan: () => this.#plan(),
      changed: () => this.#noted(),
    });
    this.#kept = makeKept({ commands, editor: this.#editor, starter: this.#starter, changed: () => this.#typed() });
    this.editor = h("div", { class: "stack" }, this.#editor.element, this.#kept.element);
    this.starter = this.#starter.element;
    store.on(["estimate", "intrinsics"], () => this.#answered());
    store.on(["plan_wished"], ({ plan_wished }) => {
      if (!plan_wished) return;
      store.set({ plan_wished: null });
      this.change(plan_wished);
    });
    againWhenTheRigIsAnother(store, this.#estimator);
  }

  /** Request an estimate when the plan has changed or its page has just opened. */
  ask() {
    if (this.#store.state.capture_page) this.#estimator.want(this.#wish());
    this.#showTroubles();
  }

  /** Request the estimate again: the rig is free now. */
  again() {
    this.#starter.forget();
    this.ask();
    if (this.#store.state.capture_page) this.#estimator.again();
  }

  #typed() {
    this.#starter.forget();
    this.#noted();
  }

  #noted() {
    this.#kept.changed();
    this.ask();
  }

  #found() {
    return planOf(this.#editor.read(), this.#view);
  }

  /** Size of one view; null until it is known. @returns {ViewSize | null} */
  get view() {
    return this.#view;
  }

  /** Change fields of the plan, as if they were typed. @param {Partial<PlanDraft>} draft */
  change(draft) {
    this.#editor.put({ ...this.#editor.read(), ...draft });
    this.#typed();
  }

  #plan() {
    const { plan, troubles } = this.#found();
    return troubles.length > 0 ? null : plan;
  }

  /** @returns {EstimateRequest | null} null: the plan is not whole */
  #wish() {
    const draft = this.#editor.read();
    const unseen = draft.field === "overlap" && this.#view === null; // the first estimate gives the size of a view
    const { plan, troubles } = planOf(unseen ? { ...draft, field: "all" } : draft, this.#view);
    return troubles.length > 0 ? null : { plan, codec: this.#starter.read().codec, distance_m: draft.assumed_m };
  }

  #answered() {
    const {
      estimate: { document, stale },
      intrinsics,
    } = this.#store.state;
    const first = this.#view === null;
    if (document && intrinsics) this.#view ??= viewSize(document, intrinsics);
    if (first && this.#view) this.ask();
    else if (!stale) this.#showTroubles();
  }

  #showTroubles() {
    this.#starter.showTroubles(this.#found().troubles);
  }
}

/**
 * Save the draft in this browser, and build the button that resets it to the defaults, which can be undone.
 * @param {{
 *   commands: Commands, editor: ReturnType<typeof makeEditor>, starter: ReturnType<typeof makeStarter>, changed: () => void
 * }} context
 */
function makeKept({ commands, editor, starter, changed }) {
  const fields = {
    read: () => ({ ...editor.read(), ...starter.read() }),
    put: (/** @type {WholeDraft} */ draft) => {
      editor.put(draft);
      starter.put(draft);
    },
  };
  const draft = keepDraft(fields);
  const putBack = (/** @type {WholeDraft} */ whole) => {
    fields.put(whole);
    changed();
  };
  const reset = textButton(
    "Start from the defaults",
    () => {
      const before = fields.read();
      putBack(draft.defaults);
      focusOn(editor.element); // the button has disappeared
      commands.notify({
        tone: "info",
        title: "The plan has its defaults again",
        detail: "",
        action: { label: "Undo", act: () => putBack(before) },
      });
    },
    { picture: "again" },
  );
  const element = h("p", { class: "actions" }, reset);
  const show = () => {
    element.hidden = !draft.differs();
  };
  show();
  return {
    element,
    changed: () => {
      show();
      draft.changed();
    },
  };
}

/** @param {Store} store @param {Estimator} estimator */
function againWhenTheRigIsAnother(store, estimator) {
  let before = "";
  store.on(["rig", "stream", "capture_page"], ({ rig, stream, capture_page }) => {
    if (!capture_page || stream !== "open" || !rig) return;
    const now = JSON.stringify([
      rig.calibration?.id,
      rig.state,
      rig.cameras.map(({ settings }) => settings),
      rig.trigger?.settle_us,
    ]);
    if (now !== before && before !== "") estimator.again();
    before = now;
  });
}
