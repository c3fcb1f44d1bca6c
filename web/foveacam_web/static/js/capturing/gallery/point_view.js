// Shows one point large: the pictures of all cameras and the anaglyph; the arrow keys go to its neighbours.

import { fresh } from "../../calibrating/calibration/pictures.js";
import { h, html, setText, update } from "../../elements/dom.js";
import { icon } from "../../elements/icons.js";
import { sheet } from "../../panels/dialogs.js";
import { pointWords } from "./dataset_words.js";

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

/** @param {(index: number) => void} left called with the shown point when the view closes */
export function makePointView(left) {
  /** @type {Shown} */
  let shown = { url: "", stamp: "", points: [], planned: 0, scans: 1 };
  let [at, bracket] = [0, "0"];
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let later;
  const [bar, pictures] = [h("div", { class: "point-bar" }), h("div", { class: "point-pictures" })];
  const dialog = sheet("Point", bar, pictures);
  dialog.classList.add("point-view");
  const title = /** @type {HTMLElement} */ (dialog.querySelector("h2"));
  const step = (/** @type {number} */ by) => {
    at = Math.min(shown.points.length - 1, Math.max(0, at + by));
    showPoint();
    clearTimeout(later);
    later = setTimeout(draw, PAUSE_MS);
  };
  const choose = (/** @type {{target: HTMLSelectElement}} */ { target }) => {
    bracket = target.value;
    draw();
  };
  const showPoint = () => {
    const { points, planned, scans } = shown;
    const point = points[at];
    if (!point) return;
    const brackets = Math.max(1, ...points.map((each) => each.brackets));
    const tool = (/** @type {string} */ label, /** @type {"back" | "on"} */ name, /** @type {number} */ by) =>
      html`<button
        type="button" class="plain" aria-label=${label} title=${label} ?disabled=${!points[at + by]} @click=${() => step(by)}
      >
        ${icon(name)}
      </button>`;
    setText(title, `Point ${point.index + 1} of ${planned}`);
    update(
      bar,
      html`${tool("Point before (←)", "back", -1)}${tool("Next point (→)", "on", 1)}
        <p class="lead" role="status">${pointWords(point, scans)}</p>
        <select aria-label="Exposure" ?hidden=${brackets === 1} @change=${choose}>
          ${Array.from({ length: brackets }, (_, number) => html`<option value=${number}>Exposure ${number + 1} of ${brackets}</option>`)}
        </select>`,
    );
  };
  const draw = () => {
    clearTimeout(later);
    const point = shown.points[at];
    if (point)
      update(
        pictures,
        PICTURES.map((picture) => figureOf(picture, { shown, point, bracket })),
      );
  };
  dialog.addEventListener("keydown", (event) => {
    const chosen = event.target instanceof HTMLSelectElement;
    if (chosen || (event.key !== "ArrowLeft" && event.key !== "ArrowRight")) return;
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
      showPoint();
      draw();
      dialog.showModal();
    },
  };
}

/**
 * @param {{name: string, title: string}} picture
 * @param {{shown: Shown, point: PointDocument, bracket: string}} context
 */
function figureOf({ name, title }, { shown: { url, stamp }, point, bracket }) {
  const both = name === "anaglyph";
  const there = both
    ? point.cameras.includes("left") && point.cameras.includes("right")
    : point.cameras.some((camera) => camera === name);
  const path = both ? `anaglyphs/${point.index}.jpg` : `points/${point.index}/${name}.jpg`;
  const address = fresh(`${url}/${path}${name === "wide" ? "" : `?bracket=${bracket}`}`, stamp);
  return html`<figure class="point-picture point-${name}" data-picture=${name}>
    ${
      there
        ? html`<a target="_blank" rel="noopener" title="Open at full size" href=${address}>
            <drawn-picture src=${address} text="${title}, point ${point.index + 1}" width="1440" height="1080"></drawn-picture>
          </a>`
        : html`<p class="blank">Not taken with this point.</p>`
    }
    <figcaption>${title}</figcaption>
  </figure>`;
}
