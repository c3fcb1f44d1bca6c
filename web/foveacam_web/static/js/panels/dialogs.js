// Builds the dialogs: help, settings, steering distance.

import { PEOPLE_ADDRESS, SETTINGS_ADDRESS } from "../addresses.js";
import { fill, h, html, setText } from "../elements/dom.js";
import { changeSettings } from "../settings.js";
import { distanceText } from "../looking/steer/words.js";
import { ROOT } from "../root.js";
import { textButton, toolButton } from "../elements/parts.js";
import { guideAt } from "./tour_steps.js";

/**
 * @import { Settings, Store } from "#console"
 */

/** @type {[string, [string, string][]][]} */
const HELP = [
  [
    "On the wide view",
    [
      ["Click or tap", "Look there with both eyes"],
      ["Drag, or press long and drag", "Look at a rectangle"],
      ["T, or Follow", "Clicks and rectangles follow what is there; Escape ends that"],
      ["Alt + drag", "Steer both eyes open loop, at the distance of “Steer at”; split eyes go together again"],
      [
        "On the vergence loop's page",
        "A click chooses the target, Alt + drag takes the eyes from the loop, P pauses it",
      ],
      ["Wheel, pinch, + and −", "Zoom where the pointer is"],
      ["Shift or middle button + drag, two fingers", "Move the picture"],
      ["Double click, 0", "Fit the picture"],
      ["Right click, D", "How far is this pixel"],
      ["Arrow keys, with Shift ten times as far", "Move a crosshair by one screen pixel, finer when zoomed in"],
      ["Enter", "Look at the crosshair"],
    ],
  ],
  [
    "Steering by hand, on the page Rig",
    [
      ["Drag in a pad", "Steer that eye, or both; let go, and they stay"],
      ["Arrow keys in a pad, with Shift a tenth as far", "Steer step by step"],
      ["Double click in a pad, Home", "To rest"],
      [
        "Gamepad: hold A or a shoulder button",
        "The left stick steers both eyes, or the left one; the right stick the right one",
      ],
    ],
  ],
  [
    "Measuring",
    [
      ["M, or the ruler on a view", "Take or put away the tool; Escape puts it away"],
      ["1, 2, 3, 4", "Point, length, plane, profile"],
      ["Click, drag, Enter at the crosshair", "Measure in what the foveae have looked at"],
    ],
  ],
  [
    "In a recording",
    [
      ["K", "Play, pause"],
      ["← and →, with Shift a second", "One frame back or on"],
      ["Home, End", "To its begin, to its end"],
      ["Comma, full stop", "Slower, faster"],
      ["A", "Both foveae in one picture, as an anaglyph"],
      ["B", "Boxes of followed targets, on and off"],
      ["V", "Focused track on and off; a click on its name focuses it"],
      ["+, −, 0, wheel", "Zoom the timeline; all of it"],
      ["D", "Depth of the moment shown"],
    ],
  ],
  [
    "Everywhere",
    [
      ["Space", "STOP: park the mirrors now"],
      ["Ctrl-K", "Find a page, a command or a target"],
      ["Escape", "Cancel the fixation; close what is open"],
      ["R", "Record, and end the recording"],
      ["I", "Rate and age of every view, on and off"],
      ["F", "Footprints of the foveae, on and off"],
      ["E", "Faults and warnings"],
      ["?", "This sheet"],
    ],
  ],
];

/** Pages of the guide, which the server renders at /guide/NAME. @type {[string, string][]} */
const GUIDE = [
  ["looking", "What a click answers, following, measuring"],
  ["devices", "Connecting a rig, cameras, steering by hand"],
  ["calibrating", "Steps, boards and screens, drift"],
  ["capturing", "Datasets, mosaics, recordings, stills"],
  ["studying", "The planner, the paper's figures, stereo networks"],
  ["operating", "Several people and rigs, packages, backups"],
];

/** @type {{key: keyof Settings, label: string, options?: [string, string][]}[]} */
const SETTINGS = [
  {
    key: "theme",
    label: "Colours",
    options: [
      ["system", "as the system"],
      ["dark", "dark"],
      ["light", "light"],
    ],
  },
  {
    key: "wide_size",
    label: "Wide view",
    options: [
      ["auto", "as large as shown"],
      ["full", "full size"],
      ["half", "half size"],
    ],
  },
  {
    key: "fovea_size",
    label: "Other views",
    options: [
      ["auto", "as large as shown"],
      ["full", "full size"],
      ["half", "half size"],
    ],
  },
  { key: "footprints", label: "Footprints of the foveae" },
  { key: "field", label: "Where both eyes, one or none can look" },
  { key: "marks", label: "Targets on the wide view" },
  { key: "hints", label: "Good targets marked for a first look" },
  { key: "readout", label: "Rate and age of every view" },
  { key: "scene", label: "3D pane" },
  { key: "single_keys", label: "Single-key shortcuts (Space always stops)" },
];

/**
 * Build a dialog with a title, closed by Escape, by its button or by a click beside it.
 * @param {string} title
 * @param {...import("../elements/dom.js").Child} content
 */
export function sheet(title, ...content) {
  const dialog = h("dialog", { class: "sheet", "aria-label": title });
  const close = toolButton("Close", "close", () => dialog.close());
  fill(dialog, html`<header><h2>${title}</h2>${close}</header>`, ...content);
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  document.body.append(dialog);
  return dialog;
}

/** @param {{showHints: () => void, tour: () => void}} context */
export function makeHelp({ showHints, tour }) {
  const groups = HELP.map(
    ([title, rows]) =>
      html`<section>
      <h3>${title}</h3>
      <dl class="keys">${rows.flatMap(([keys, what]) => [html`<dt>${keys}</dt>`, html`<dd>${what}</dd>`])}</dl>
    </section>`,
  );
  const pages = GUIDE.flatMap(([name, what]) => [
    html`<dt><a href=${`${ROOT}/guide/${name}`} target="_blank" rel="noopener">${capitalised(name)}</a></dt>`,
    html`<dd>${what}</dd>`,
  ]);
  const guide = html`<section>
    <h3>Guide</h3>
    <dl class="keys">${pages}</dl>
  </section>`;
  const links = h(
    "p",
    { class: "lead" },
    "Programs do all of this by REST: ",
    html`<a href="${ROOT}/docs" target="_blank" rel="noopener">reference</a>`,
    ".",
  );
  const hints = h(
    "p",
    { class: "lead" },
    textButton("Take the tour: five steps", () => {
      dialog.close();
      tour();
    }),
    " ",
    textButton("Mark good targets on the wide view", () => {
      showHints();
      dialog.close();
    }),
  );
  const here = h("a", { class: "plain primary", target: "_blank", rel: "noopener" });
  const dialog = sheet("Help", h("p", { class: "lead" }, here), hints, guide, ...groups, links);
  return {
    showModal: () => {
      const name = guideAt(location.hash);
      here.href = `${ROOT}/guide/${name}`;
      setText(here, `Guide to this page: ${capitalised(name)}`);
      dialog.showModal();
      here.focus();
    },
  };
}

/** @param {string} name */
const capitalised = (name) => name[0]?.toUpperCase() + name.slice(1);

/** @param {Store} store */
export function makeSettings(store) {
  const all = h("a", {
    href: SETTINGS_ADDRESS,
    text: "All settings, presets of cameras and windows",
    on: { click: () => dialog.close() },
  });
  const people = h("a", {
    href: PEOPLE_ADDRESS,
    text: "People and rights: who may use this server",
    on: { click: () => dialog.close() },
  });
  const dialog = sheet(
    "Settings",
    h("div", { class: "settings" }, settingRows(store)),
    h("p", { class: "lead" }, "Kept in this browser. ", all),
    h("p", { class: "lead" }, people),
  );
  return dialog;
}

/** Build a row for each setting of this browser. @param {Store} store */
export function settingRows(store) {
  return SETTINGS.map((entry) => settingRow(entry, store));
}

/** @param {(typeof SETTINGS)[number]} entry @param {Store} store */
function settingRow({ key, label, options }, store) {
  const change = (/** @type {unknown} */ value) =>
    changeSettings(store, /** @type {Partial<Settings>} */ ({ [key]: value }));
  if (!options) {
    const box = h("input", { type: "checkbox", on: { change: () => change(box.checked) } });
    store.on(["settings"], ({ settings }) => (box.checked = Boolean(settings[key])));
    return html`<label class="setting">${label}${box}</label>`;
  }
  const select = h(
    "select",
    { on: { change: () => change(select.value) } },
    options.map(([value, text]) => html`<option value=${value}>${text}</option>`),
  );
  store.on(["settings"], ({ settings }) => (select.value = String(settings[key])));
  return html`<label class="setting">${label}${select}</label>`;
}

/**
 * Build the choice of the distance at which both eyes are steered: the slider is linear in 1/distance, its end is infinity.
 * @param {Store} store
 * @param {string} [id] of the slider
 */
export function makeSteerDistance(store, id = "steer-distance") {
  const nearest_m = 0.5;
  const text = h("output", { class: "number", for: id });
  const slider = h("input", {
    type: "range",
    id,
    min: "0",
    max: "1",
    step: "0.01",
    value: "0",
    "aria-label": "Distance for steering",
  });
  slider.addEventListener("input", () => {
    const closeness = Number(slider.value);
    store.set({ steer_distance_m: closeness < 0.01 ? null : nearest_m / closeness });
  });
  store.on(["steer_distance_m"], ({ steer_distance_m }) => {
    const words = distanceText(steer_distance_m);
    setText(text, words);
    slider.setAttribute("aria-valuetext", steer_distance_m === null ? "infinity, eyes parallel" : words);
  });
  return h(
    "div",
    { class: "steering", title: "How far away both eyes are pointed by hand" },
    html`<label for=${id}>Steer at</label>`,
    slider,
    text,
  );
}
