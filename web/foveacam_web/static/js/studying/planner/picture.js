// Asks for the scale of a picture that is used as a map: a number, or a line along something of known length.

import { numberField } from "../../elements/parts.js";
import { fill, h, html, s, setText, svg } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { sheet } from "../../panels/dialogs.js";
import { plainly } from "../../devices/rig/scale.js";

/**
 * @typedef {{x: number, y: number}} Point
 * @typedef {{name: string, url: string, width: number, height: number}} Picture `url`: a data URL
 */

const NO_SCALE =
  "The picture has no scale: press both ends of a known length and type it in, or type in the metres a pixel";

/**
 * Build the dialog that asks for the scale.
 * @param {(picture: Picture, m_per_px: number | null) => Promise<string | null>} take returns the reason of a refusal, null when it is accepted
 */
export function makePictureSheet(take) {
  /** @type {Picture | null} */
  let picture = null;
  /** @type {Point[]} */
  let ends = [];
  const drawing = s("svg", {
    class: "scale-drawing",
    role: "img",
    "aria-label": "The picture; press two points whose distance you know",
  });
  const length = numberField("Its length", { min: 0, step: "any", unit: "m" });
  const scale = numberField("Metres a pixel", { min: 0, step: "any", unit: "m/px" });
  const line = h("p", { class: "why", role: "status" });
  const refused = h("p", { class: "refused", role: "alert" });
  const long_px = () => {
    const [one, other] = ends;
    return one && other ? Math.hypot(other.x - one.x, other.y - one.y) : 0;
  };
  const draw = () => {
    if (!picture) return;
    const { width, height, url } = picture;
    const unit = Math.max(width, height) / 400;
    drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const [one, other] = ends;
    fill(
      drawing,
      svg`<image href=${url} width=${width} height=${height}></image>`,
      one && other
        ? svg`<line x1=${one.x} y1=${one.y} x2=${other.x} y2=${other.y} stroke-width=${2 * unit}></line>`
        : null,
      ends.map(({ x, y }) => svg`<circle cx=${x} cy=${y} r=${4 * unit} stroke-width=${1.5 * unit}></circle>`),
    );
    setText(
      line,
      ends.length < 2
        ? "Press the two ends of something whose length you know, or type in the scale."
        : `The line is ${plainly(long_px())} px long.`,
    );
    const known_m = length.value();
    if (ends.length === 2 && known_m && long_px() > 0)
      scale.input.value = String(Number((known_m / long_px()).toPrecision(5)));
  };
  drawing.addEventListener("click", (event) => {
    if (!picture) return;
    const way = drawing.getScreenCTM();
    if (!way) return;
    const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(way.inverse());
    const at = { x: Math.min(picture.width, Math.max(0, x)), y: Math.min(picture.height, Math.max(0, y)) };
    ends = ends.length === 2 ? [at] : [...ends, at];
    draw();
  });
  length.input.addEventListener("input", draw);
  const form = h(
    "form",
    {
      class: "run",
      novalidate: true,
      on: {
        submit: (/** @type {Event} */ event) => {
          event.preventDefault();
          if (picture) void give(picture);
        },
      },
    },
    drawing,
    line,
    html`<div class="fields">${length.element}${scale.element}</div>`,
    refused,
    html`<p class="actions"><button type="submit" class="plain primary">Use this picture</button></p>`,
  );
  form.addEventListener("input", () => setText(refused, ""));
  const give = async (/** @type {Picture} */ given) => {
    const why = scale.value() === null ? NO_SCALE : await take(given, scale.value());
    setText(refused, sentence(why));
    if (why === null) dialog.close();
  };
  const dialog = sheet(
    "How large is it?",
    h("p", { class: "lead", text: "Seen from above; dark is where something stands." }),
    form,
  );
  dialog.classList.add("picture-sheet");
  return (/** @type {Picture} */ found) => {
    [picture, ends] = [found, []];
    length.input.value = scale.input.value = "";
    setText(refused, "");
    draw();
    dialog.showModal();
  };
}

/** Read a file as a picture; null when the browser cannot. @param {File} file @returns {Promise<Picture | null>} */
export async function pictureOf(file) {
  const url = await new Promise((/** @type {(value: string) => void} */ resolve) => {
    const reader = new FileReader();
    reader.addEventListener("load", () => resolve(String(reader.result)));
    reader.addEventListener("error", () => resolve(""));
    reader.readAsDataURL(file);
  });
  const image = new Image();
  image.src = url;
  try {
    await image.decode();
  } catch {
    return null; // not a picture, or of an unsupported format
  }
  return { name: file.name, url, width: image.naturalWidth, height: image.naturalHeight };
}
