// The panel of the loop's settings: a group each with its numbers, choices and Reset.

import { fill, h, html, setText } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { Dial } from "../../devices/rig/dial.js";
import { GROUPS, modeOf, MODES, numberOf, patchOf, TRACKERS } from "./settings.js";
import { textButton } from "../../elements/parts.js";

/**
 * @import { LoopSettingsDocument } from "#api"
 * @import { LoopOrders } from "./orders.js"
 * @import { GroupName, Mode, NumberSetting } from "./settings.js"
 * @typedef {{element: HTMLElement, show: (settings: LoopSettingsDocument, open: boolean) => void}} Control
 */

/** @param {HTMLElement} place @param {{orders: LoopOrders, settings: () => LoopSettingsDocument | null}} context */
export function mountSettings(place, { orders, settings }) {
  const controls = GROUPS.map(({ group, title, of, numbers }) => {
    const parts = [
      ...choicesOf(group, orders),
      ...numbers.map((each) => numberControl(each, of, { orders, settings })),
    ];
    return { title, group, parts };
  });
  fill(
    place,
    html`<div class="loop-groups">
      ${controls.map(
        ({ title, group, parts }) =>
          html`<section class="loop-group" data-group=${group}>
            <header>
              <h4>${title}</h4>
              ${textButton("Reset", () => orders.reset(group), {
                name: `Reset ${title}`,
                title: "Back to the defaults of this group",
              })}
            </header>
            ${parts.map(({ element }) => element)}
          </section>`,
      )}
    </div>`,
    html`<div class="actions">
      ${textButton("Reset all settings", () => orders.reset(null), { kind: "plain reset-all" })}
    </div>`,
  );
  return (/** @type {LoopSettingsDocument} */ now, /** @type {boolean} */ open) => {
    for (const { parts } of controls) for (const part of parts) part.show(now, open);
  };
}

/** @param {GroupName} group @param {LoopOrders} orders @returns {Control[]} */
function choicesOf(group, orders) {
  if (group === "tracker")
    return [
      choiceControl("Tracker", TRACKERS, {
        title:
          "Follows the target in the wide view while it moves. Template: correlation with its picture; filter: a correlation filter that adapts with every image.",
        now: ({ tracker }) => tracker,
        change: (tracker) => orders.set({ tracker }),
      }),
    ];
  if (group === "prediction")
    return [
      choiceControl(
        "Predict",
        [
          [true, "On"],
          [false, "Off"],
        ],
        {
          title: "Aim at the predicted position of a tracked target at mid-exposure.",
          now: ({ predict }) => predict,
          change: (predict) => orders.set({ predict }),
        },
      ),
    ];
  return [];
}

/**
 * @template {string | boolean} T
 * @param {string} name
 * @param {[T, string][]} known
 * @param {{title: string, now: (settings: LoopSettingsDocument) => T, change: (value: T) => Promise<{refusal: string | null}>}} options
 * @returns {Control}
 */
function choiceControl(name, known, { title, now, change }) {
  const refused = h("p", { class: "refused", role: "alert" });
  let shown = 0;
  const select = chooser(
    name,
    known.map(([value, text]) => ({ value: String(value), text })),
    async (index) => {
      const chosen = known[index];
      if (!chosen) return;
      const { refusal } = await change(chosen[0]);
      setText(refused, refusal ? sentence(refusal) : "");
      if (refusal) select.selectedIndex = shown;
    },
  );
  return {
    element: h(
      "div",
      { class: "dial", title },
      html`<label class="line"><span>${name}</span>${select}</label>`,
      refused,
    ),
    show: (settings, open) => {
      shown = known.findIndex(([value]) => value === now(settings));
      if (document.activeElement !== select) select.selectedIndex = shown;
      select.disabled = !open;
    },
  };
}

/**
 * @param {string} label
 * @param {{value: string, text: string}[]} known
 * @param {(index: number) => unknown} chosen
 */
function chooser(label, known, chosen) {
  const select = h(
    "select",
    { "aria-label": label, on: { change: () => void chosen(select.selectedIndex) } },
    known.map(({ value, text }) => html`<option value=${value}>${text}</option>`),
  );
  return select;
}

/**
 * @param {NumberSetting} setting
 * @param {string} of
 * @param {{orders: LoopOrders, settings: () => LoopSettingsDocument | null}} context
 * @returns {Control}
 */
function numberControl(setting, of, { orders, settings }) {
  const { name, label, unit, span, title, kind = "linear", presets = [], whole = false } = setting;
  const choice = typeof name === "string" ? MODES[name] : undefined;
  const refused = h("p", { class: "refused", role: "alert" });
  const ask = async (/** @type {number | null} */ value) => {
    const before = settings();
    if (!before) return { taken: null, refusal: "the loop is not known yet" };
    const answer = await orders.set(patchOf(before, name, value));
    return { taken: answer.settings && numberOf(answer.settings, name), refusal: answer.refusal };
  };
  const modes = choice && chooser(`${label}, mode`, choice.modes, (index) => choose(choice.modes[index]));
  const choose = async (/** @type {Mode | undefined} */ mode) => {
    const { refusal } = await ask(mode?.number === undefined ? (choice?.usual ?? null) : mode.number);
    setText(refused, refusal ? sentence(refusal) : "");
  };
  const dial = new Dial({
    ...{ name: label, unit, of, title, kind, presets, whole, ask },
    ...(modes && { beside: modes, below: refused }),
  });
  return {
    element: dial.element,
    show: (now, open) => {
      const value = numberOf(now, name);
      const mode = choice ? modeOf(choice.modes, value) : "some";
      if (modes) {
        if (document.activeElement !== modes) modes.value = mode;
        modes.disabled = !open;
      }
      dial.update(span, mode === "some" ? (value ?? undefined) : undefined, open, mode !== "some");
    },
  };
}
