// Shows the server's diagrams: by name, enlarged by a click; two of the same view with a slider between them.

import { h, html, keyed } from "../../elements/dom.js";

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

/** Build a diagram with its title; a click opens it at full size. @param {PictureDocument} picture */
export function figure({ title, url }) {
  const failed = (/** @type {{target: Element}} */ { target }) =>
    target.closest("a")?.replaceWith(h("p", { class: "empty", text: "This picture could not be loaded." }));
  const loaded = (/** @type {{target: HTMLImageElement}} */ { target: image }) =>
    image.closest("figure")?.classList.toggle("broad", image.naturalWidth > BROAD * image.naturalHeight);
  return keyed(
    url,
    html`<figure class="diagram">
      <a href=${url} target="_blank" rel="noopener" title="Open at full size">
        <img loading="lazy" src=${url} alt=${title} @error=${failed} @load=${loaded} />
      </a>
      <figcaption>${title}</figcaption>
    </figure>`,
  );
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
  const over = html`<img class="over" src=${before.url} alt=${before.title} />`;
  const box = h(
    "div",
    { class: "pair" },
    html`<img src=${after.url} alt=${after.title} />`,
    over,
    html`<span class="name left">before</span>`,
    html`<span class="name right">after</span>`,
  );
  const place = () => {
    box.style.setProperty("--part", `${slider.value}%`);
    slider.setAttribute("aria-valuetext", `${slider.value} % before, the rest after`);
  };
  slider.addEventListener("input", place);
  place();
  return html`<figure class="diagram before-after">
    ${box}
    ${slider}
    <figcaption>${before.title} | ${after.title}</figcaption>
  </figure>`;
}
