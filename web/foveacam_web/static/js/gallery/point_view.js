// Shows one point large: the pictures of all cameras and the anaglyph; the arrow keys go to its neighbours.

import { fresh } from "../calibration/pictures.js";
import { fill, h, say } from "../dom.js";
import { icon } from "../icons.js";
import { sheet } from "../panels/dialogs.js";
import { pointWords } from "./dataset_words.js";
import { makeDrawn } from "./drawn.js";

/**
 * @import { PointDocument } from "#api"
 * @typedef {{url: string, stamp: string, points: PointDocument[], planned: number, scans: number}} Shown `stamp`: what the pictures' addresses change with
 */

const PAUSE_MS = 120; // pause before loading while an arrow key is held: the server draws the pictures

/** @type {readonly {name: string, title: string}[]} */
const PICTURES = Object.freeze([
  { name: "left", title: "Left fovea" },
  { name: "right", title: "Right fovea" },
  { name: "anaglyph", title: "Both, rectified: left red, right cyan" },
  { name: "wide", title: "Wide camera" },
]);

/**
 * @param {(index: number) => void} left called with the shown point when the view closes
 */
export function makePointView(left) {
  /** @type {Shown} */
  let shown = { url: "", stamp: "", points: [], planned: 0, scans: 1 };
  let at = 0;
  const words = h("p", { class: "lead", role: "status" });
  const bracket = h("select", { "aria-label": "Exposure", on: { change: () => draw() } });
  const tool = (/** @type {string} */ label, /** @type {"back" | "on"} */ picture, /** @type {number} */ by) =>
    h(
      "button",
      { type: "button", class: "plain", "aria-label": label, title: label, on: { click: () => step(by) } },
      icon(picture),
    );
  const [before, after] = [tool("Point before (←)", "back", -1), tool("Next point (→)", "on", 1)];
  const figures = PICTURES.map(makeFigure);
  const dialog = sheet(
    "Point",
    h("div", { class: "point-bar" }, before, after, words, bracket),
    h(
      "div",
      { class: "point-pictures" },
      figures.map(({ element }) => element),
    ),
  );
  dialog.classList.add("point-view");
  const title = /** @type {HTMLElement} */ (dialog.querySelector("h2"));
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let later;
  const step = (/** @type {number} */ by) => {
    at = Math.min(shown.points.length - 1, Math.max(0, at + by));
    tell();
    clearTimeout(later);
    later = setTimeout(draw, PAUSE_MS);
  };
  const tell = () => {
    const point = shown.points[at];
    if (!point) return;
    say(title, `Point ${point.index + 1} of ${shown.planned}`);
    say(words, pointWords(point, shown.scans));
    before.disabled = at === 0;
    after.disabled = at === shown.points.length - 1;
  };
  const draw = () => {
    clearTimeout(later);
    const point = shown.points[at];
    if (point) for (const figure of figures) figure.show(shown, point, bracket.value || "0");
  };
  dialog.addEventListener("keydown", (event) => {
    if (event.target === bracket || (event.key !== "ArrowLeft" && event.key !== "ArrowRight")) return;
    event.preventDefault();
    step(event.key === "ArrowLeft" ? -1 : 1);
  });
  dialog.addEventListener("close", () => left(shown.points[at]?.index ?? 0));
  return {
    dialog,
    open: (/** @type {Shown} */ now, /** @type {number} */ index) => {
      shown = now;
      at = Math.max(
        0,
        now.points.findIndex((point) => point.index === index),
      );
      const brackets = Math.max(1, ...now.points.map((point) => point.brackets));
      fill(
        bracket,
        ...Array.from({ length: brackets }, (_, number) =>
          h("option", { value: number, text: `Exposure ${number + 1} of ${brackets}` }),
        ),
      );
      bracket.hidden = brackets === 1;
      tell();
      draw();
      dialog.showModal();
    },
  };
}

/** @param {{name: string, title: string}} picture */
function makeFigure({ name, title }) {
  const drawn = makeDrawn({ width: 1440, height: 1080 });
  const link = h("a", { target: "_blank", rel: "noopener", title: "Open at full size" }, drawn.element);
  const none = h("p", { class: "blank", text: "Not taken with this point." });
  const element = h(
    "figure",
    { class: `point-picture point-${name}`, data: { picture: name } },
    link,
    none,
    h("figcaption", { text: title }),
  );
  return {
    element,
    show: (/** @type {Shown} */ { url, stamp }, /** @type {PointDocument} */ point, /** @type {string} */ bracket) => {
      const there =
        name === "anaglyph"
          ? point.cameras.includes("left") && point.cameras.includes("right")
          : point.cameras.some((camera) => camera === name);
      link.hidden = !there;
      none.hidden = there;
      if (!there) return;
      const path = name === "anaglyph" ? `anaglyphs/${point.index}.jpg` : `points/${point.index}/${name}.jpg`;
      link.href = fresh(`${url}/${path}${name === "wide" ? "" : `?bracket=${bracket}`}`, stamp);
      drawn.show(link.getAttribute("href") ?? "", `${title}, point ${point.index + 1}`);
    },
  };
}
