// Controls around a mosaic: choice of layers, zoom, depth scale, readout at the pointer.

import { h, html, setText } from "../../../elements/dom.js";
import { angle, MISSING, number } from "../../../elements/format.js";
import { icon } from "../../../elements/icons.js";
import { gradient, ticksOf } from "./depth.js";

/**
 * @import { MadeMosaic } from "#api"
 * @import { MosaicMix } from "#page"
 * @import { MosaicViewer, Reading } from "./viewer.js"
 */

/** @type {[MosaicMix["shown"], string][]} */
const CHOICES = [
  ["picture", "Picture"],
  ["depth", "Depth"],
  ["both", "Both"],
];

/**
 * Build the choice of layers, with the opacity of depth over the picture.
 * @param {(mix: MosaicMix) => void} changed
 * @param {boolean} has_depth
 */
export function makeMix(changed, has_depth) {
  /** @type {MosaicMix} */
  let mix = { shown: "picture", share: 0.6 };
  const slider = h("input", {
    type: "range",
    min: 0,
    max: 100,
    value: 60,
    "aria-label": "Opacity of depth",
    on: { input: () => set({ share: slider.valueAsNumber / 100 }) },
  });
  const opacity = h("label", { class: "opacity" }, "Opacity", slider);
  const buttons = CHOICES.map(([shown, text]) => ({
    shown,
    button: h(
      "button",
      {
        type: "button",
        class: "chip",
        data: { layer: shown },
        disabled: shown !== "picture" && !has_depth,
        title: has_depth ? undefined : "No depth was found",
        on: { click: () => set({ shown }) },
      },
      text,
    ),
  }));
  const set = (/** @type {Partial<MosaicMix>} */ part) => {
    mix = { ...mix, ...part };
    for (const { shown, button } of buttons) button.setAttribute("aria-pressed", String(shown === mix.shown));
    opacity.hidden = mix.shown !== "both";
    changed(mix);
  };
  const element = h(
    "div",
    { class: "mosaic-mix", role: "group", "aria-label": "Layers" },
    buttons.map(({ button }) => button),
    opacity,
  );
  return { element, begin: () => set({}) };
}

/** @param {() => MosaicViewer} viewer */
export function makeZoom(viewer) {
  const tool = (
    /** @type {string} */ label,
    /** @type {import("../../../elements/icons.js").IconName} */ name,
    /** @type {() => void} */ act,
  ) =>
    html`<button type="button" class="tool" aria-label=${label} title=${label} @click=${act}>
      ${icon(name)}
    </button>`;
  const scale = h("output", { class: "number" });
  const element = h(
    "div",
    { class: "mosaic-zoom", role: "group", "aria-label": "Zoom" },
    tool("Smaller (−)", "minus", () => viewer().zoom(1 / 1.5)),
    tool("Larger (+)", "plus", () => viewer().zoom(1.5)),
    tool("All of it (0)", "fit", () => viewer().fit()),
    html`<button type="button" class="tool words" title="Its own pixels (1)" @click=${() => viewer().whole()}>
      1:1
    </button>`,
    scale,
  );
  return {
    element,
    show: (/** @type {number} */ css_px) =>
      setText(scale, `${number(css_px * devicePixelRatio * 100, css_px < 0.1 ? 1 : 0)} %`),
  };
}

/** Build the scale of depth in metres, near at the left. @param {MadeMosaic} made */
export function makeScale({ near_m, far_m }) {
  if (near_m === null || far_m === null) return { element: h("div", { hidden: true }), show: () => {} };
  const colours = h("div", { class: "colours" });
  colours.style.background = gradient();
  const place = (/** @type {number} */ z_m) => `${(100 * (z_m - near_m)) / (far_m - near_m)}%`;
  const digits = far_m - near_m < 0.8 ? 2 : far_m - near_m < 8 ? 1 : 0;
  const ticks = ticksOf({ near_m, far_m }).map((z_m) => {
    const tick = h("span", { class: "tick", text: `${number(z_m, digits)} m` });
    tick.style.insetInlineStart = place(z_m);
    return tick;
  });
  const mark = h("span", { class: "mark", hidden: true });
  const element = h(
    "div",
    {
      class: "mosaic-scale",
      role: "img",
      "aria-label": `Depth from ${number(near_m, 1)} m, red, to ${number(far_m, 1)} m, blue`,
    },
    colours,
    mark,
    html`<div class="scale">${ticks}</div>`,
  );
  return {
    element,
    show: (/** @type {number | null} */ z_m) => {
      mark.hidden = z_m === null;
      if (z_m !== null) mark.style.insetInlineStart = place(Math.min(far_m, Math.max(near_m, z_m)));
    },
  };
}

/** Build the readout at the pointer. */
export function makeReadout() {
  const [where, gaze, depth] = [
    h("dd", { class: "number" }),
    h("dd", { class: "number" }),
    h("dd", { class: "number" }),
  ];
  const element = h(
    "dl",
    { class: "mosaic-readout" },
    html`<div><dt>Depth</dt>${depth}</div>`,
    html`<div><dt>Angles</dt>${gaze}</div>`,
    html`<div><dt>Pixel</dt>${where}</div>`,
  );
  const show = (/** @type {Reading} */ reading) => {
    setText(where, reading ? `${reading.pixel.x}, ${reading.pixel.y}` : MISSING);
    setText(gaze, reading ? `${angle(reading.ax_deg, 3)}  ${angle(reading.ay_deg, 3)}` : MISSING);
    setText(depth, !reading ? MISSING : reading.z_m === null ? "unknown" : `${number(reading.z_m, 3)} m`);
  };
  show(null);
  return { element, show };
}
