// The page of a dataset's mosaic: viewer of picture and depth, making it, its figures and files, its surface in 3D.

import { badge, choiceField, figures, nothing, textButton } from "../../../elements/parts.js";
import { CAPTURE_ADDRESS, CONSOLE_ADDRESS, galleryAddress } from "../../../addresses.js";
import { changing, h, html, update } from "../../../elements/dom.js";
import { count, dayTime, pixels, sentence } from "../../../elements/format.js";
import { icon } from "../../../elements/icons.js";
import { computedBy } from "../../../video/depth_words.js";
import { OVERLAPPING } from "../../capture/plan.js";
import { sizeWords } from "../dataset_words.js";
import { Made } from "../made.js";
import { makeMix, makeReadout, makeScale, makeZoom } from "./tools.js";
import { MosaicViewer } from "./viewer.js";
import { percent, size } from "./words.js";
import { waiting } from "../../../elements/waiting.js";

/**
 * @import { MadeMosaic, MosaicDocument, MosaicNeedsDocument, MosaicRequest, Problem } from "#api"
 * @import { Store } from "#console"
 * @import { GalleryPlace } from "#page"
 * @import { GalleryContext } from "../page.js"
 * @typedef {{anew: boolean, begun: boolean, needs: MosaicNeedsDocument, scans: number[], brackets: number[], eye: "left" | "right"}} Offer
 */

const MESH_MS = 60_000; // about ten megabytes are packed for every viewer

/** The mosaic of one dataset. @extends {Made<MosaicDocument, MosaicRequest>} */
class Mosaic extends Made {
  /** Show the surface in 3D, or take it away. @param {boolean} shown */
  async show(shown) {
    const path = `${this.path}/in_scene`;
    const mosaic = await this.commands.send(shown ? "PUT" : "DELETE", path, { patience_ms: MESH_MS });
    if (!mosaic) return;
    this.adopt(/** @type {MosaicDocument} */ (mosaic));
    if (shown)
      this.commands.notify({
        tone: "good",
        title: "The surface is in the 3D view",
        detail: "It stays there until it is taken away.",
        action: { label: "Go there", act: () => (location.hash = CONSOLE_ADDRESS) },
      });
  }
}

/** @param {GalleryPlace} at @param {GalleryContext} context */
export function openMosaic(at, { store, commands, follow, signal }) {
  const id = at.id ?? "";
  const mosaic = new Mosaic(id, "mosaic", commands);
  const place = h("div", { class: "mosaic-place" });
  const [picture, offer] = [h("div", { class: "mosaic-picture" }), h("div")];
  const showPicture = changing(picture, (/** @type {MadeMosaic} */ made) => pictureOf(made, signal));
  const showOffer = changing(offer, (/** @type {Offer} */ now) => offerOf(now, mosaic));
  update(place, waiting("Loading the mosaic"));
  mosaic.changed = () => {
    const { entry } = mosaic;
    const list = html`<a href=${galleryAddress("datasets")}>To the datasets</a>`;
    if (entry === null) return update(place, [nothing(sentence(mosaic.missing)), html`<p class="lead">${list}</p>`]);
    const { state, made, outdated, needs, scans, brackets } = entry;
    const possible = state !== "building" && needs !== null && (made === null || outdated);
    if (possible)
      showOffer({
        anew: made !== null,
        begun: state === "unfinished",
        needs,
        scans,
        brackets,
        eye: made?.eye ?? "left",
      });
    if (made) showPicture(made);
    update(place, pageOf({ id, mosaic, store }, entry, { picture: made && picture, offer: possible && offer }));
  };
  follow(mosaic);
  return place;
}

/**
 * @param {{id: string, mosaic: Mosaic, store: Store}} context
 * @param {MosaicDocument} document
 * @param {{picture: unknown, offer: unknown}} parts
 */
function pageOf({ id, mosaic, store }, document, { picture, offer }) {
  const { name, made, state, refusal, outdated } = document;
  const making = state === "building" || mosaic.trouble || (refusal && !made) || offer;
  return html`<article class="mosaic-page">
    <header class="mosaic-head">
      <div class="name">
        <a class="tool" href=${galleryAddress("datasets", id)} aria-label="Back to the dataset" title="Back to the dataset">
          ${icon("back")}
        </a>
        <h3 tabindex="-1">Mosaic of ${name}</h3>
        ${badge(...wordOf({ state, made, refusal, outdated }))}
      </div>
      <div class="actions">${made && actionsOf(made, document, mosaic)}</div>
    </header>
    ${making && html`<div class="making">${mosaic.making((why) => wayOut(why, store))}${offer}</div>`}
    ${picture}
    ${made && html`<div class="panel mosaic-facts"><div class="inside">${factsOf(made)}</div></div>`}
  </article>`;
}

/**
 * Offer a plan that a mosaic can be made of, where the dataset's views are the reason why none can be made.
 * @param {Problem} why
 * @param {Store} store
 */
function wayOut({ type }, store) {
  if (!type.endsWith("/invalid-input")) return null;
  const plan = () => {
    store.set({ plan_wished: OVERLAPPING });
    location.hash = CAPTURE_ADDRESS;
  };
  return html`<p class="actions">${textButton("Plan a capture whose views overlap", plan)}</p>`;
}

/** @param {Pick<MosaicDocument, "state" | "outdated" | "made" | "refusal">} mosaic @returns {[string, string]} */
function wordOf({ state, outdated, made, refusal }) {
  if (state === "building") return ["plain", made ? "being made again" : "being made"];
  if (made) return outdated ? ["warn", "older than its dataset"] : ["good", "complete"];
  if (state === "unfinished") return ["warn", "unfinished"];
  return refusal ? ["warn", "not possible"] : ["plain", "not made yet"];
}

/** @param {MadeMosaic} made @param {MosaicDocument} document @param {Mosaic} mosaic */
function actionsOf({ glb_url, ply_url }, { in_scene, state }, mosaic) {
  const file = (/** @type {string | null} */ url, /** @type {string} */ text) =>
    url && html`<a class="plain" href=${url} download="">${icon("down")}${text}</a>`;
  return html`${
    glb_url &&
    html`<button
        type="button" class=${in_scene ? "plain" : "plain primary"} aria-pressed=${String(in_scene)}
        @click=${() => void mosaic.show(!in_scene)}
      >
        ${icon("cube")}${in_scene ? "Take out of 3D" : "Show in 3D"}
      </button>`
  }
    ${file(glb_url, "GLB")}${file(ply_url, "PLY")}
    <button
      type="button" class="plain" ?disabled=${state === "building"} title="The dataset stays; it can be made again"
      @click=${() => void mosaic.remove()}
    >
      ${icon("trash")}Remove
    </button>`;
}

/** @param {MadeMosaic["matching"]} matching @returns {[string, string][]} */
function failuresOf({ failed_pairs }) {
  return failed_pairs > 0 ? [["Network failed on", `${count(failed_pairs)} pairs, which were matched`]] : [];
}

/** @param {MadeMosaic} made */
function factsOf({ eye, views, width, height, tiles, size_bytes, seams, depth, matching, made_utc }) {
  return [
    figures([
      ["Eye", eye],
      ["Foveae", count(views)],
      ["Size", size(width, height)],
      ["Tiles", `${count(tiles)}, ${sizeWords(size_bytes)} in all`],
      ["Made", dayTime(made_utc)],
    ]),
    figures([
      ["Seams", seams.after_rms_px === null ? null : `${pixels(seams.after_rms_px)} rms`],
      ["Measured at", `${count(seams.links)} places`],
      ["Depth known", percent(depth.known)],
      ["Seen by two pairs or more", percent(depth.seen_twice)],
      ["Pairs differ by", depth.between_pairs_rel_rms === null ? null : `${percent(depth.between_pairs_rel_rms)} rms`],
      ["Depth by", computedBy(matching.backend, matching.sha256)],
      ...failuresOf(matching),
    ]),
    html`<p class="note">Where no fovea saw, the wide view shows. Depth is where both eyes saw texture.</p>`,
  ];
}

/** @param {Offer} offer @param {Mosaic} mosaic */
function offerOf({ anew, begun, needs, scans, brackets, eye }, mosaic) {
  const numbered = (/** @type {number[]} */ from) =>
    from.map((each) => /** @type {[string, string]} */ ([String(each), String(each + 1)]));
  const eyes = choiceField("Picture of", [
    ["left", "Left eye"],
    ["right", "Right eye"],
  ]);
  const scan = choiceField("Scan", numbered(scans));
  const bracket = choiceField("Exposure", numbered(brackets));
  eyes.put(eye);
  const make = () =>
    void mosaic.make({
      eye: /** @type {MosaicRequest["eye"]} */ (eyes.value()),
      scan: Number(scan.value()),
      bracket: Number(bracket.value()),
    });
  const words = anew
    ? "The dataset has grown since this mosaic was made. It stays until a new one is complete."
    : begun
      ? "A mosaic was begun. It continues where it was interrupted."
      : "All foveae of the dataset are laid into one picture at their own resolution, with the depth of all pairs. The rig stays free meanwhile.";
  const { views, width, height, needed_bytes, free_bytes } = needs;
  return html`<div class=${anew ? "offer small" : "offer"}>
    ${!anew && icon("pictures")}
    <p class="lead">${words}</p>
    <p class="number">
      ${views} foveae · ${size(width, height)} · up to ${sizeWords(needed_bytes)} on the disk (${sizeWords(free_bytes)} free)
    </p>
    <div class="fields">
      ${eyes.element}${scans.length > 1 && scan.element}${brackets.length > 1 && bracket.element}
      <button type="button" class="plain primary" @click=${make}>
        ${begun ? "Go on" : anew ? "Make it again" : "Make the mosaic"}
      </button>
      ${
        begun &&
        html`<button type="button" class="plain" @click=${() => void mosaic.remove()}>${icon("trash")}Throw it away</button>`
      }
    </div>
  </div>`;
}

/** @param {MadeMosaic} made @param {AbortSignal} signal */
function pictureOf(made, signal) {
  const readout = makeReadout();
  const scale = makeScale(made);
  const zoom = makeZoom(() => viewer);
  const viewer = new MosaicViewer(made, {
    onReading: (reading) => {
      readout.show(reading);
      scale.show(reading?.z_m ?? null);
    },
    moved: zoom.show,
    signal,
  });
  const mix = makeMix((now) => {
    viewer.show(now);
    scale.element.classList.toggle("idle", now.shown === "picture");
  }, made.near_m !== null);
  mix.begin();
  const look = setInterval(() => viewer.element.setAttribute("aria-busy", String(!viewer.settled)), 200);
  signal.addEventListener("abort", () => clearInterval(look));
  return html`<div class="mosaic-bar">${mix.element}${zoom.element}</div>
    ${viewer.element}
    <div class="mosaic-bar">${readout.element}${scale.element}</div>`;
}
