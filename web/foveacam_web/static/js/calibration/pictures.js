// Shows the server's diagrams: by name, enlarged by a click; two of the same view with a slider between them.

import { h } from "../dom.js";
import { nothing } from "./parts.js";

/** @import { PictureDocument, SessionDocument } from "#api" */

const BROAD = 1.5; // wider pictures hold several diagrams and take the whole row

/**
 * Return the session's pictures of these names, in this order; an address changes with its picture.
 * @param {SessionDocument | null} session
 * @param {string[]} names
 * @returns {PictureDocument[]}
 */
export function picturesOf(session, names) {
  if (!session) return [];
  return names.flatMap((name) => {
    const picture = session.pictures.find((each) => each.name === name);
    return picture ? [picture] : [];
  });
}

/**
 * Return an address that changes with the stamp, so that the browser loads the picture again.
 * @param {string} url
 * @param {string} stamp identifies what it shows
 */
export function fresh(url, stamp) {
  return `${url}${url.includes("?") ? "&" : "?"}of=${encodeURIComponent(stamp)}`;
}

/**
 * Build a diagram with its title; a click opens it at full size.
 * @param {PictureDocument} picture
 */
export function figure({ title, url }) {
  const image = h("img", {
    src: url,
    alt: title,
    loading: "lazy",
    on: {
      error: () => link.replaceWith(nothing("This picture could not be loaded.")),
      load: () => box.classList.toggle("broad", image.naturalWidth > BROAD * image.naturalHeight),
    },
  });
  const link = h("a", { href: url, target: "_blank", rel: "noopener", title: "Open at full size" }, image);
  const box = h("figure", { class: "diagram" }, link, h("figcaption", { text: title }));
  return box;
}

/**
 * Build two pictures of the same view, one over the other, with a slider between them.
 * @param {PictureDocument} before
 * @param {PictureDocument} after
 */
export function beforeAfter(before, after) {
  const slider = h("input", {
    type: "range",
    min: 0,
    max: 100,
    value: 50,
    "aria-label": `${before.title} on the left, ${after.title} on the right`,
  });
  const over = h("img", { class: "over", src: before.url, alt: before.title });
  const box = h(
    "div",
    { class: "pair" },
    h("img", { src: after.url, alt: after.title }),
    over,
    h("span", { class: "name left", text: "before" }),
    h("span", { class: "name right", text: "after" }),
  );
  const place = () => {
    box.style.setProperty("--part", `${slider.value}%`);
    slider.setAttribute("aria-valuetext", `${slider.value} % before, the rest after`);
  };
  slider.addEventListener("input", place);
  place();
  return h(
    "figure",
    { class: "diagram before-after" },
    box,
    slider,
    h("figcaption", { text: `${before.title} | ${after.title}` }),
  );
}
