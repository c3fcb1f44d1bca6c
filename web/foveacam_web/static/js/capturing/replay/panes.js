// The panes of the player on a board: each shows the newest frame of its camera at the moment, with the overlays of the
// wide view. The same panes stand in the recording's page and in windows of their own.

import { outcome, request } from "../../transport/api.js";
import { recordingPath } from "../gallery/recording_words.js";
import { Board } from "../../operating/windows/board.js";
import { layoutOf, sourcesOf } from "../../operating/windows/layout.js";
import { frameAt } from "./clock.js";
import { Newest } from "./newest.js";
import { ReplaySlot } from "./slot.js";
import { SOURCES } from "./stereo.js";
import { absenceOf, trackName } from "./tracks.js";
import { API } from "../../root.js";

/**
 * @import { MomentDocument, PlayerLayout, TimelineDocument, TracksDocument } from "#api"
 * @import { Layout, Role, Source } from "#page"
 * @import { LayoutKeeper } from "../../operating/windows/board.js"
 * @import { Overlays } from "./slot.js"
 * @typedef {{at_s: number, quick: boolean, style: PlayerLayout["style"], shown: string[], overlays: Overlays}} Now
 *   what the panes show; `quick`: at half size; `shown`: the streams that are switched on
 * @typedef {{id: string, timeline: TimelineDocument, tracks: TracksDocument}} Replayed
 */

const NARROW_PX = 760;
const WIDE_LAYOUT = /** @type {Layout} */ (layoutOf("row-640(wide,column-500(left,right))"));
export const NARROW_LAYOUT = /** @type {Layout} */ (layoutOf("column-600(wide,row-500(left,right))"));
const EYES = Object.freeze(/** @type {const} */ (["left", "right"]));

/** Return whether the page has no room for panes side by side. */
export function isNarrow() {
  return innerWidth < NARROW_PX;
}

/** The panes of one recording. */
export class ReplayPanes {
  #id;
  #streams;
  #tracks;
  /** @type {Map<Source, ReplaySlot>} */
  #slots = new Map();
  /** @type {Now | null} */
  #now = null;
  /** @type {MomentDocument | null} */
  #moment = null;
  #moments;

  /**
   * @param {HTMLElement} place
   * @param {Replayed} recording
   * @param {{keep: LayoutKeeper, aside: (source: Source) => HTMLElement | null, signal: AbortSignal}} options
   */
  constructor(place, { id, timeline, tracks }, { keep, aside, signal }) {
    this.#id = id;
    this.#streams = new Map(timeline.streams.map((stream) => [stream.role, stream]));
    this.#tracks = tracks.tracks;
    this.#moments = new Newest((at_s) => this.#read(at_s));
    this.board = new Board(place, {
      make: (source, acts) => {
        const slot = new ReplaySlot(source, { acts, size: this.#sizeOf(source), aside });
        this.#slots.set(source, slot);
        return slot;
      },
      keep: {
        ...keep,
        write: (layout) => {
          keep.write(layout);
          if (this.#now) this.show(this.#now);
        },
      },
      sources: SOURCES.filter((source) => this.#has(source)),
      usual: this.usual,
      signal,
    });
  }

  /** Whether both foveae can be shown in one picture. */
  get pairs() {
    return this.#has("anaglyph");
  }

  /** The layout where none is kept: the cameras that there are. @returns {Layout} */
  get usual() {
    const roles = [...this.#streams.keys()];
    if (roles.length === 3) return isNarrow() ? NARROW_LAYOUT : WIDE_LAYOUT;
    const [first = "wide", second] = roles;
    return second ? { axis: "row", share: 0.5, parts: [first, second] } : first;
  }

  /** @param {Now} now */
  show(now) {
    this.#now = now;
    for (const source of sourcesOf(this.board.layout)) this.#slots.get(source)?.show(this.#wanted(source, now));
    const eye = EYES.map((role) => this.#streams.get(role)).find((stream) => stream !== undefined);
    const at_s = eye ? (eye.t_s[frameAt(eye, now.at_s)] ?? 0) : now.at_s;
    void this.#moments.want(at_s.toFixed(6));
    this.#showMoment();
  }

  /** Return the picture of a source at a moment, or why there is none. @param {Source} source @param {Now} now */
  #wanted(source, { at_s, quick, style, shown }) {
    const root = `${API}${recordingPath(this.#id)}`;
    const roles = this.#needed(source);
    for (const role of roles) {
      const stream = this.#streams.get(role);
      const track = this.#tracks.find(({ kind, name }) => kind === "frames" && name === stream?.name);
      if (!stream || !track) return { reason: `This recording has no ${role} camera.` };
      if (!shown.includes(stream.name)) return { reason: `${trackName(track)} is switched off in the timeline (V).` };
      const absence = absenceOf(track, at_s);
      if (absence !== "") return { reason: absence };
    }
    const [role = "wide"] = roles;
    const stream = /** @type {import("#api").TimelineStream} */ (this.#streams.get(role));
    const index = frameAt(stream, at_s);
    const t_s = (stream.t_s[index] ?? 0).toFixed(6);
    if (source === "anaglyph") return { url: `${root}/anaglyph.jpg?t_s=${t_s}&style=${style}` };
    if (source === "difference") return { url: `${root}/difference.jpg?t_s=${t_s}` };
    return { url: `${root}/frames/${role}/${index}.jpg${quick ? "?scale=2" : ""}` };
  }

  /** @param {Source} source @returns {Role[]} */
  #needed(source) {
    return source === "anaglyph" || source === "difference" ? [...EYES] : [/** @type {Role} */ (source)];
  }

  /** @param {Source} source */
  #has(source) {
    return this.#needed(source).every((role) => this.#streams.has(role));
  }

  /** @param {Source} source */
  #sizeOf(source) {
    return this.#streams.get(this.#needed(source)[0] ?? "wide") ?? { width: 4, height: 3 };
  }

  /** @param {string} at_s */
  async #read(at_s) {
    const { answer, error } = await outcome(request("GET", recordingPath(this.#id, `/frames?t_s=${at_s}`)));
    if (error) return;
    this.#moment = answer;
    this.#showMoment();
  }

  #showMoment() {
    const [moment, now] = [this.#moment, this.#now];
    if (moment && now) for (const slot of this.#slots.values()) slot.showMoment(moment, now.overlays);
  }
}
