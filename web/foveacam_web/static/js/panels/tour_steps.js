// The five steps of the first tour, and when each is done. Pure functions.

import { CAPTURE_ADDRESS, CONSOLE_ADDRESS, galleryAddress } from "../addresses.js";

/**
 * @import { EventDocument } from "#api"
 * @import { GalleryPlace } from "#page"
 * @typedef {{title: string, words: string, keys: string, at: string, to: string, place: string, done: (event: EventDocument) => boolean}} Step
 *   `keys`: the same by the keyboard; `at`: address of its page; `to`: what the button says that leads there; `place`: what
 *   is put into the focus there; `done`: whether an event says that it was done
 */

/** @type {readonly Step[]} */
export const STEPS = Object.freeze([
  {
    title: "Look",
    words: "Click something in the wide view. Both foveae look at it, and its distance appears.",
    keys: "Or move the crosshair by the arrow keys, and press Enter.",
    at: CONSOLE_ADDRESS,
    to: "To the wide view",
    place: ".pane-wide .surface",
    done: ({ kind }) => kind === "fixation.done",
  },
  {
    title: "Look around",
    words: "Press “Look around” above the 3D view. The rig looks at the whole field once.",
    keys: "",
    at: CONSOLE_ADDRESS,
    to: "To the button",
    place: ".wide-depth-look",
    done: ({ kind }) => kind === "wide_depth.surveyed",
  },
  {
    title: "Measure",
    words:
      "Take the ruler of the wide view, choose “Length”, and click both ends of something you have looked at: its size appears.",
    keys: "Or press M, then 2, and Enter at each end.",
    at: CONSOLE_ADDRESS,
    to: "To the ruler",
    place: ".pane-wide .measure-button",
    done: ({ kind }) => kind === "measurement.created",
  },
  {
    title: "Capture",
    words:
      "Take a raster of 3 × 3 points: set Columns and Rows to 3, and press Start. Every point is a picture of each camera.",
    keys: "",
    at: CAPTURE_ADDRESS,
    to: "To the capture page",
    place: "#capture-page input",
    done: ({ kind }) => kind === "capture.ended",
  },
  {
    title: "Gallery",
    words: "Open what you captured: its pictures, its mosaic, and its files for other programs.",
    keys: "",
    at: galleryAddress("datasets"),
    to: "To the gallery",
    place: "#gallery a[href*='/datasets/']",
    done: () => false,
  },
]);
/** The last step is done when a dataset is open. */
export const LAST = STEPS.length - 1;

/** Return whether a dataset is open. @param {GalleryPlace | null} gallery */
export function showsDataset(gallery) {
  return gallery?.tab === "datasets" && gallery.id !== null;
}

/**
 * Return the step after the events since the tour began, each of which may end the step that waits for it.
 * @param {number} step
 * @param {EventDocument[]} events
 */
export function stepAfter(step, events) {
  let now = step;
  for (const event of events) if (STEPS[now]?.done(event)) now += 1;
  return now;
}

/** Pages of the guide by the part of the console that is open. @type {[RegExp, string][]} */
const GUIDE = [
  [/^#\/(capture|gallery)/, "capturing"],
  [/^#\/(calibration|acceptance)/, "calibrating"],
  [/^#\/(rig|setup)(\/|$)/, "devices"],
  [/^#\/(planner|compare)/, "studying"],
  [/^#\/(engine|rigs|people|settings)/, "operating"],
];

/** Return the name of the guide's page about an address of the console. @param {string} hash */
export function guideAt(hash) {
  return GUIDE.find(([at]) => at.test(hash))?.[1] ?? "looking";
}
