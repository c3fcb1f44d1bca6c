// The loop's settings by group: names, units, ranges, descriptions; reads one, builds the request of a change. Pure functions.

/**
 * @import { LoopGains, LoopSettingsDocument, LoopSettingsPatch, SpanDocument } from "#api"
 * @import { ScaleKind } from "../../devices/rig/scale.js"
 * @typedef {"pan" | "depth" | "vertical"} GainGroup
 * @typedef {GainGroup | "match" | "timing" | "tracker" | "prediction"} GroupName
 * @typedef {keyof LoopGains} GainName
 * @typedef {Exclude<keyof LoopSettingsDocument, GainGroup | "tracker" | "predict">} PlainName
 * @typedef {{
 *   name: PlainName | [GainGroup, GainName], label: string, unit: string, span: SpanDocument, title: string,
 *   kind?: ScaleKind, presets?: number[], whole?: boolean
 * }} NumberSetting
 * @typedef {{value: string, text: string, number: number | null | undefined}} Mode `number`: what is sent; undefined: the number beside it
 */

export const UNIT_WORDS = "A unit of loop time, u, is 1 ms divided by the sensitivity: 10 ms at 0.1.";

const GAIN_SPAN = { low: 0, high: 2 };

/** @param {GainGroup} group @param {string} what @returns {NumberSetting[]} */
function gains(group, what) {
  return [
    {
      name: [group, "kp"],
      label: "Kp",
      unit: "°/°",
      span: GAIN_SPAN,
      title: `Proportional gain: share of the error of ${what} that each look corrects.`,
    },
    {
      name: [group, "ki"],
      label: "Ki",
      unit: "/u",
      span: GAIN_SPAN,
      kind: "root",
      title: `Integral gain: corrects the remaining error of ${what}, per unit of loop time.`,
    },
    {
      name: [group, "kd"],
      label: "Kd",
      unit: "u",
      span: GAIN_SPAN,
      title: `Derivative gain: damps changes of ${what}, in units of loop time.`,
    },
  ];
}

/** @type {readonly {group: GroupName, title: string, of: string, numbers: NumberSetting[]}[]} */
export const GROUPS = Object.freeze([
  { group: "pan", title: "Pan gains", of: "pan", numbers: gains("pan", "both pan axes") },
  { group: "depth", title: "Depth gains", of: "depth", numbers: gains("depth", "the vergence") },
  {
    group: "vertical",
    title: "Vertical gains",
    of: "vertical shift",
    numbers: gains("vertical", "the vertical shift"),
  },
  {
    group: "match",
    title: "Match",
    of: "match",
    numbers: [
      {
        name: "template_scale",
        label: "Template scale",
        unit: "of 1",
        span: { low: 0, high: 1 },
        title: "Scale at which the foveae are matched in the wide view: 0 its own, 1 four times that. Finer is slower.",
      },
      {
        name: "min_score",
        label: "Least score",
        unit: "of 1",
        span: { low: 0, high: 1 },
        title: "Least correlation of both eyes for a correction.",
      },
      {
        name: "expand_x",
        label: "Strip width",
        unit: "fields",
        span: { low: 1, high: 4 },
        title: "Width of the strip of the wide view that is searched, in fields of a fovea.",
      },
      {
        name: "expand_y",
        label: "Strip height",
        unit: "fields",
        span: { low: 1, high: 4 },
        title: "Height of the strip of the wide view that is searched, in fields of a fovea.",
      },
    ],
  },
  {
    group: "timing",
    title: "Timing",
    of: "timing",
    numbers: [
      {
        name: "sensitivity",
        label: "Sensitivity",
        unit: "u/ms",
        span: { low: 0.01, high: 1 },
        kind: "log",
        presets: [0.01, 0.1, 1],
        title: `Loop time per millisecond: scales Ki up and Kd down. ${UNIT_WORDS}`,
      },
      {
        name: "correct_for_ms",
        label: "Correct for",
        unit: "ms",
        span: { low: 100, high: 10_000 },
        kind: "log",
        title:
          "Time after the choice of a target during which the loop corrects. While a tracker follows the target, it always does.",
      },
      {
        name: "most_hz",
        label: "Looks a second",
        unit: "/s",
        span: { low: 0.5, high: 1000 },
        kind: "log",
        title: "Largest number of looks a second; unlimited: as fast as the rig.",
      },
    ],
  },
  {
    group: "tracker",
    title: "Tracker",
    of: "tracker",
    numbers: [
      {
        name: "box_width_px",
        label: "Box width",
        unit: "px",
        span: { low: 16, high: 400 },
        whole: true,
        title: "Width of the tracker's template about the target, wide px.",
      },
      {
        name: "box_height_px",
        label: "Box height",
        unit: "px",
        span: { low: 16, high: 400 },
        whole: true,
        title: "Height of the tracker's template about the target, wide px.",
      },
    ],
  },
  {
    group: "prediction",
    title: "Prediction",
    of: "prediction",
    numbers: [
      {
        name: "lead_ms",
        label: "Lead",
        unit: "ms",
        span: { low: -50, high: 50 },
        title: "Added to the time of the prediction, which is mid-exposure: compensates a delay that is not measured.",
      },
    ],
  },
]);

/** Settings that need no number in some of their modes. @type {Readonly<Partial<Record<string, {modes: Mode[], usual: number}>>>} */
export const MODES = Object.freeze({
  correct_for_ms: {
    usual: 1000,
    modes: [
      { value: "always", text: "always", number: null },
      { value: "some", text: "for a time", number: undefined },
      { value: "never", text: "never", number: 0 },
    ],
  },
  most_hz: {
    usual: 10,
    modes: [
      { value: "unlimited", text: "unlimited", number: null },
      { value: "some", text: "at most", number: undefined },
    ],
  },
});

/** @type {[LoopSettingsDocument["tracker"], string][]} */
export const TRACKERS = [
  ["template", "Template"],
  ["filter", "Filter"],
  ["off", "Off: it stays where it was chosen"],
];

/** @param {LoopSettingsDocument} settings @param {NumberSetting["name"]} name */
export function numberOf(settings, name) {
  return typeof name === "string" ? settings[name] : settings[name[0]][name[1]];
}

/**
 * Return the request that changes one number; gains are sent three at a time.
 * @param {LoopSettingsDocument} settings
 * @param {NumberSetting["name"]} name
 * @param {number | null} value
 * @returns {LoopSettingsPatch}
 */
export function patchOf(settings, name, value) {
  if (typeof name === "string") return { [name]: value };
  const [group, gain] = name;
  return { [group]: { ...settings[group], [gain]: value } };
}

/** Return the mode of a value: that which sends exactly it, otherwise that with a number. @param {Mode[]} modes @param {number | null} value */
export function modeOf(modes, value) {
  return (
    (modes.find(({ number }) => number === value) ?? modes.find(({ number }) => number === undefined))?.value ?? ""
  );
}
