// A view's pane: canvas, title, rate and age, and the reason when there is no picture.

import { fill, h, html, setText } from "../elements/dom.js";
import { clockTime, millis, remedyOf, sentence, span } from "../elements/format.js";
import { icon } from "../elements/icons.js";
import { paceOf } from "./pace.js";
import { resolutionWords } from "./resolution.js";
import { Viewport } from "./viewport.js";

/** @import { AnnotatedName, ConsoleState, ShownView, ViewName } from "#page" */

/** @type {Readonly<Record<ViewName, {title: string, needs: import("#page").Role[]}>>} */
export const VIEWS = Object.freeze({
  wide: { title: "Wide", needs: ["wide"] },
  left: { title: "Left fovea", needs: ["left"] },
  right: { title: "Right fovea", needs: ["right"] },
  anaglyph: { title: "Anaglyph", needs: ["left", "right"] },
  difference: { title: "Difference", needs: ["left", "right"] },
  depth: { title: "Depth", needs: ["left", "right"] },
  wide_depth: { title: "Wide depth", needs: ["wide"] },
  wide_zoom: { title: "Wide zoomed", needs: ["wide", "left", "right"] },
  calibration_wide: { title: "Wide, annotated", needs: ["wide"] },
  calibration_left: { title: "Left fovea, annotated", needs: ["left"] },
  calibration_right: { title: "Right fovea, annotated", needs: ["right"] },
});

/** The annotated views of the calibration procedures; they exist while one runs. */
export const ANNOTATED = Object.freeze(
  /** @type {AnnotatedName[]} */ (["calibration_wide", "calibration_left", "calibration_right"]),
);

/** @type {Set<ViewName>} made after each look, not with each frame */
const STILL = new Set(["wide_depth", ...ANNOTATED]);
/** @type {Set<ViewName>} made of both foveae */
const STEREO = new Set(["anaglyph", "difference", "depth", "wide_zoom"]);
const FLOWING_FPS = 1;
const ADDED = ", annotated"; // beside the title, where there is room

/** Return whether a view has a picture with each frame, not with each look. @param {ViewName} name */
export function isLive(name) {
  return !STILL.has(name);
}

/** The pane of one view; `wide.js` adds its gestures. */
export class Pane {
  /** @type {string | null} */
  #frozen_since = null;
  /** The part of the sensor that the picture shows: a scaled one leaves out a remainder at the edge. */
  #drawn = { width: 1440, height: 1080 };

  /** @param {ViewName} name */
  constructor(name) {
    this.name = name;
    this.viewport = new Viewport(1440, 1080);
    this.canvas = h("canvas", { class: "picture", width: 1440, height: 1080 });
    this.notice = h("div", { class: "notice", hidden: true });
    this.badge = h("div", { class: "frozen-badge", hidden: true, role: "status" });
    this.note = h("p", { class: "eye-note", hidden: true, role: "status" });
    this.readout = h("span", { class: "rate" });
    this.resolution = h("span", { class: "resolution", hidden: true });
    this.title = h("h2", { text: VIEWS[name].title.replace(ADDED, "") });
    this.tools = h("div", { class: "tools" });
    this.surface = h("div", { class: "surface" }, this.canvas, this.note, this.badge, this.notice);
    this.enlarge = h(
      "button",
      {
        class: "tool",
        type: "button",
        "aria-pressed": "false",
        "aria-label": `Enlarge the view ${VIEWS[name].title}`,
        title: "Enlarge (Escape returns)",
        on: { click: () => this.setLarge(!this.large) },
      },
      icon("expand"),
    );
    this.tools.append(this.enlarge);
    this.header = h("header", {}, this.title, this.resolution, this.readout, this.tools);
    this.element = h(
      "section",
      {
        class: `pane pane-${name}`,
        "aria-label": `View ${VIEWS[name].title}`,
        data: { view: name },
      },
      this.header,
      this.surface,
    );
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `Live picture: ${VIEWS[name].title}`);
    this.placed = () => {};
    this.resized = () => {};
    new ResizeObserver(() => {
      this.place();
      this.resized();
    }).observe(this.surface);
  }

  get large() {
    return this.element.classList.contains("large");
  }

  /** @param {boolean} large */
  setLarge(large) {
    this.element.classList.toggle("large", large);
    document.body.classList.toggle("has-large", large);
    this.enlarge.setAttribute("aria-pressed", String(large));
    fill(this.enlarge, icon(large ? "shrink" : "expand"));
    this.resized();
  }

  /** Return whether the pane is visible now. */
  get visible() {
    return this.surface.clientWidth > 0 && this.surface.clientHeight > 0;
  }

  /** Return the width of the picture on the screen in device pixels. */
  get device_width() {
    return this.viewport.scale * this.viewport.width * devicePixelRatio;
  }

  /**
   * Take the size of the picture, sensor px; one of another scale keeps zoom and place.
   * @param {{width: number, height: number}} drawn
   * @param {number} [scale] sensor pixels for one of the picture's pixels
   */
  describe({ width, height }, scale = 1) {
    if (width === this.#drawn.width && height === this.#drawn.height) return;
    this.#drawn = { width, height };
    const full = this.viewport;
    const remainder = Math.max(full.width - width, full.height - height);
    if (Math.min(full.width - width, full.height - height) < 0 || remainder >= scale)
      this.viewport = new Viewport(width, height);
    this.place();
  }

  /** Place the canvas by the viewport. */
  place() {
    const { viewport, canvas } = this;
    viewport.resize(this.surface.getBoundingClientRect(), 1 / devicePixelRatio);
    const { x, y } = viewport.origin;
    canvas.style.width = `${this.#drawn.width}px`;
    canvas.style.height = `${this.#drawn.height}px`;
    canvas.style.transform = `translate(${x}px, ${y}px) scale(${viewport.scale})`;
    canvas.classList.toggle("coarse", viewport.scale * devicePixelRatio >= 3);
    this.placed();
  }

  /** @param {ConsoleState} state */
  update(state) {
    const shown = state.shown[this.name];
    if (shown && shown.count > 0)
      this.describe({ width: shown.width * shown.scale, height: shown.height * shown.scale }, shown.scale);
    const trouble = this.#trouble(state, shown);
    this.notice.hidden = trouble === null;
    if (trouble) fill(this.notice, html`<strong>${trouble.title}</strong>`, html`<p>${trouble.detail}</p>`);
    this.canvas.classList.toggle("dim", trouble !== null && !trouble.empty);
    this.canvas.hidden = trouble !== null && trouble.empty;
    this.#showNote(state, trouble !== null);
    this.#showRate(state, shown);
    this.#showResolution(state, shown);
    this.#showPace(state, trouble !== null);
  }

  /**
   * Show why this eye does not see the target of the last fixation, until the eyes turn away.
   * @param {ConsoleState} state
   * @param {boolean} noticed
   */
  #showNote({ current, eyes_stay }, noticed) {
    const seen =
      this.name === "left"
        ? current?.fixation?.left_view
        : this.name === "right"
          ? current?.fixation?.right_view
          : null;
    const reason = seen && !seen.sees_target ? sentence(seen.reason) || "This eye does not see the target." : "";
    this.note.hidden = noticed || !eyes_stay || reason === "";
    setText(this.note, reason);
    this.note.title = reason;
  }

  /** @param {ConsoleState} state @param {ShownView | undefined} shown */
  #showRate(state, shown) {
    this.readout.hidden = !state.settings.readout;
    const what = VIEWS[this.name].title.endsWith(ADDED) ? "annotated · " : "";
    if (!shown || shown.count === 0 || state.stream !== "open") setText(this.readout, "");
    else if (STILL.has(this.name) && shown.fps < FLOWING_FPS)
      setText(this.readout, `${what}${span(shown.age_ms / 1000)} old`);
    else setText(this.readout, `${what}${shown.fps.toFixed(1)} fps · ${millis(shown.age_ms)}`);
    this.readout.title = shown ? `frame ${shown.seq}, ${shown.width} × ${shown.height} px` : "";
  }

  /** Show the resolution of a camera's own picture. @param {ConsoleState} state @param {ShownView | undefined} shown */
  #showResolution({ rig }, shown) {
    const camera = rig?.cameras.find(({ role }) => role === this.name);
    const words = shown && shown.count > 0 ? resolutionWords(camera, shown.binning) : null;
    this.resolution.hidden = words === null;
    setText(this.resolution, words?.text ?? "");
    this.resolution.title = words?.meaning ?? "";
  }

  /** Show that the view stands still or comes slowly. @param {ConsoleState} state @param {boolean} noticed */
  #showPace(state, noticed) {
    const found = noticed || STILL.has(this.name) ? null : paceOf(state, this.name);
    this.badge.hidden = found === null;
    if (!found?.frozen) this.#frozen_since = null;
    if (found === null) return;
    if (found.frozen) this.#frozen_since ??= new Date(Date.now() - found.for_ms).toISOString();
    const told = found.frozen
      ? [`Frozen since ${clockTime(this.#frozen_since)}`, reasonOf(state, VIEWS[this.name].needs)]
      : [found.text, found.reason];
    setText(this.badge, told.filter(Boolean).join(": "));
    this.badge.title = this.badge.textContent ?? "";
  }

  /**
   * Return why there is no picture or no recent one; null when there is one.
   * @param {ConsoleState} state
   * @param {ShownView | undefined} shown
   * @returns {{title: string, detail: string, empty: boolean} | null}
   */
  #trouble(state, shown) {
    const empty = !shown || shown.count === 0;
    if (state.stream === "down") {
      return { title: "Offline", detail: "This is the last picture. Reconnecting by itself.", empty };
    }
    const missing =
      state.rig?.cameras.filter(
        (camera) =>
          VIEWS[this.name].needs.includes(/** @type {import("#page").Role} */ (camera.role)) && !camera.connected,
      ) ?? [];
    if (missing.length > 0)
      return {
        ...missingCamera(
          state,
          missing.map((camera) => camera.role),
        ),
        empty,
      };
    if (!empty) return null;
    if (STEREO.has(this.name) && state.rig && !state.rig.calibration)
      return { title: "Not calibrated", detail: "The directions of both foveae are not known.", empty };
    if (this.name.startsWith("calibration_"))
      return { title: "No picture yet", detail: "The procedure's pictures appear here.", empty };
    const opening = state.rig?.state === "opening"; // nothing is missing yet
    if (state.rig?.mirrors && !state.rig.mirrors.connected && this.name !== "wide" && !opening) {
      return { ...missingMirrors(state), empty };
    }
    return {
      title: "Waiting for the first picture",
      detail: opening ? "The rig is opening." : "",
      empty,
    };
  }
}

/** @param {ConsoleState} state @param {string[]} roles */
function missingCamera(state, roles) {
  const problem = state.rig?.problems.find(({ device }) => roles.some((role) => device.includes(role)));
  const reason = sentence(reasonOf(state, roles)) || "See the rig's status.";
  const detail = problem ? `${sentence(problem.detail)} ${remedyOf(problem)}` : reason;
  return { title: `No ${roles.join(" and ")} camera`, detail };
}

/**
 * Return the reasons of the cameras' links for missing frames; empty where they have none.
 * @param {ConsoleState} state
 * @param {string[]} roles
 */
function reasonOf({ rig }, roles) {
  const cameras =
    rig?.cameras.filter(({ role, link }) => roles.includes(role) && link && link.phase !== "streaming") ?? [];
  const reason = cameras.map(({ link }) => link?.reason ?? "").find(Boolean);
  if (reason) return reason;
  const apart =
    roles.some((role) => role !== "wide") &&
    // one pulse exposes both
    rig?.divergence?.some(({ setting }) => setting === "exposure_ms" || setting === "trigger");
  return apart ? "the foveae are set differently, see the rig's page" : "";
}

/** @param {ConsoleState} state */
function missingMirrors(state) {
  const problem = state.rig?.problems.find(({ device }) => /mirror|controller/.test(device));
  const detail = problem ? `${sentence(problem.detail)} ${remedyOf(problem)}` : "See the rig's status.";
  return { title: "No trigger: the mirror controller is missing", detail };
}
