// The section for a dataset's reference over the rail's long baselines: making it, its picture, figures and files.

import { allHold, choiceField, numberField, panel, textButton } from "../../elements/parts.js";
import { figure } from "../../calibrating/calibration/pictures.js";
import { changing, h, html } from "../../elements/dom.js";
import { dayTime } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { Made } from "./made.js";
import { referenceWords, wholeMm } from "./reference_words.js";

/**
 * @import { MadeReference, ReferenceDocument, ReferenceRequest, ReferenceStop } from "#api"
 * @import { GalleryContext } from "./page.js"
 * @typedef {Made<ReferenceDocument, ReferenceRequest>} Reference
 * @typedef {{anew: boolean, stops: ReferenceStop[], brackets: number[]}} Offer
 */

const TITLE =
  "Against depth: deviation of the rig's own depth from the reference, and the reference's stated error; on the right in per cent.";

/**
 * Return a function that shows the section; nothing where fewer than two scans have a rail position.
 * @param {string} id
 * @param {GalleryContext} context
 * @param {() => void} changed called when it has to be shown again
 */
export function makeReference(id, { commands, follow }, changed) {
  /** @type {Reference} */
  const reference = new Made(id, "reference", commands);
  reference.changed = changed;
  const offer = h("div", { class: "stack" });
  const showOffer = changing(offer, (/** @type {Offer} */ now) => offerOf(now, reference));
  follow(reference);
  return () => {
    const now = reference.entry;
    if (now === null || (now.stops.length < 2 && now.state === "none")) return null;
    const { made, outdated, refusal, stops, brackets } = now;
    const idle = now.state !== "building";
    const offered = idle && !refusal;
    if (offered) showOffer({ anew: made !== null, stops, brackets });
    return panel(
      "Depth against long baselines",
      html`<div class="making">
        ${reference.making()}
        ${made && html`<div class="stack">${resultOf(made, { outdated, idle, reference })}</div>`}
        ${offered && offer}
      </div>`,
    );
  };
}

/** @param {MadeReference} made @param {{outdated: boolean, idle: boolean, reference: Reference}} context */
function resultOf(made, { outdated, idle, reference }) {
  const { svg_url, png_url, samples_url, made_utc } = made;
  const file = (/** @type {string} */ url, /** @type {string} */ text) =>
    html`<a class="plain" href=${url} download="">${icon("down")}${text}</a>`;
  return html`<p>${referenceWords(made)}</p>
    <div class="reference-plot">${figure({ name: "reference", title: TITLE, url: svg_url })}</div>
    <p class="actions">
      ${file(svg_url, "SVG")}${file(png_url, "PNG")}${file(samples_url, "Samples (CSV)")}
      ${textButton("Remove", () => reference.remove(), {
        picture: "trash",
        title: "The dataset stays; it can be made again",
        disabled: !idle,
      })}
    </p>
    <p class=${outdated ? "warn-text" : "note"}>
      Made ${dayTime(made_utc)}${outdated ? "; the dataset has grown since: make it again" : ""}.
    </p>`;
}

/** @param {Offer} offer @param {Reference} reference */
function offerOf({ anew, stops, brackets }, reference) {
  const scan = choiceField("Depth of", [
    ["", "the scan nearest to the middle"],
    ...stops.map(
      ({ scan: number, rail_m }) =>
        /** @type {[string, string]} */ ([String(number), `scan ${number + 1}, at ${wholeMm(rail_m)}`]),
    ),
  ]);
  const bracket = choiceField(
    "Exposure",
    brackets.map((each) => [String(each), String(each + 1)]),
  );
  const across = numberField("Samples across a view", { value: 10, min: 2, max: 40 });
  const rail_mm = numberField("Error of a place on the rail", { value: 0.1, min: 0, max: 50, step: "any", unit: "mm" });
  const make = () => {
    if (!allHold(across, rail_mm)) return;
    void reference.make({
      scan: scan.value() === "" ? null : Number(scan.value()),
      bracket: Number(bracket.value()),
      across: across.value() ?? 10,
      rail_sigma_m: (rail_mm.value() ?? 0.1) / 1000,
    });
  };
  const fields = html`<div class="fields">
    ${scan.element}${brackets.length > 1 && bracket.element}${across.element}${rail_mm.element}
  </div>`;
  const button = html`<p class="actions">
    ${textButton(anew ? "Make it again" : "Make the reference", make, { kind: anew ? "plain" : "plain primary" })}
  </p>`;
  if (anew) return html`<details><summary>Make it again</summary><div class="stack">${fields}${button}</div></details>`;
  return html`<p class="lead">
      The depth of one scan is triangulated over the scans from the other places on the rail, and the rig's own depth
      compared with it. The rig stays free meanwhile.
    </p>
    <details><summary>Settings</summary>${fields}</details>
    ${button}`;
}
