// The server's diagrams: found by name, loaded again only when what they show has changed, large on demand.

import { h } from "../dom.js";
import { nothing } from "./parts.js";

/**
 * @typedef {import("./documents.js").Picture} Picture
 * @typedef {import("./documents.js").SessionDocument} SessionDocument
 */

/**
 * The session's pictures of these names, in this order, each with an address that changes when its content does.
 * @param {SessionDocument | null} session
 * @param {string[]} names
 * @returns {Picture[]}
 */
export function picturesOf(session, names) {
  if (!session) return [];
  return names.flatMap((name) => {
    const picture = session.pictures.find((each) => each.name === name);
    return picture ? [{ ...picture, url: fresh(picture.url, stamp(session, name)) }] : [];
  });
}

/**
 * What a picture is drawn from, in a few characters.
 * @param {SessionDocument} session
 * @param {string} name
 */
function stamp(session, name) {
  const wide = session.wide;
  if (name === "coverage" || name.startsWith("wide")) return `${wide?.samples.length}-${wide?.samples.at(-1)?.id}-${wide?.fit?.rms_px}`;
  if (name === "settle") return session.settle?.axes.map((axis) => axis.settle_ms).join("-") ?? "";
  if (name === "epipolar" || name === "overlay") return `${session.fit?.calibration_id}-${session.check?.epipolar_rms_px}-${session.check?.poses}`;
  return session.fit?.calibration_id ?? "";
}

/**
 * @param {string} url
 * @param {string} stamp
 */
export function fresh(url, stamp) {
  return `${url}${url.includes("?") ? "&" : "?"}of=${encodeURIComponent(stamp)}`;
}

/**
 * A diagram with its title; a click opens it at full size.
 * @param {Picture} picture
 */
export function figure({ title, url }) {
  const image = h("img", { src: url, alt: title, loading: "lazy", on: { error: () => {
    link.replaceWith(nothing("This picture could not be loaded."));
  } } });
  const link = h("a", { href: url, target: "_blank", rel: "noopener", title: "Open at full size" }, image);
  return h("figure", { class: "diagram" }, link, h("figcaption", { text: title }));
}

/**
 * Two pictures of the same place, one over the other, with a slider between them.
 * @param {Picture} before
 * @param {Picture} after
 */
export function beforeAfter(before, after) {
  const slider = h("input", { type: "range", min: 0, max: 100, value: 50, "aria-label": `${before.title} on the left, ${after.title} on the right` });
  const over = h("img", { class: "over", src: before.url, alt: before.title });
  const box = h("div", { class: "pair" }, h("img", { src: after.url, alt: after.title }), over,
    h("span", { class: "name left", text: "before" }), h("span", { class: "name right", text: "after" }));
  const place = () => {
    box.style.setProperty("--part", `${slider.value}%`);
    slider.setAttribute("aria-valuetext", `${slider.value} % before, the rest after`);
  };
  slider.addEventListener("input", place);
  place();
  return h("figure", { class: "diagram before-after" }, box, slider, h("figcaption", { text: `${before.title} | ${after.title}` }));
}
