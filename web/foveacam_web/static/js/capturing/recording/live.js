// Follows the recording in progress, by whatever client, and starts and ends one for the button.

import { RequestError, request } from "../../transport/api.js";
import { isBeingMade, recordingPath, tallyWords } from "../gallery/recording_words.js";
import { QuietReads } from "../../transport/quiet.js";

/**
 * @import { EventDocument, RecordingDocument, RecordingRequest } from "#api"
 * @import { Commands, Store } from "#console"
 */

const EVERY_MS = 1000;

/** The recording in progress as one page knows it. */
export class LiveRecording {
  #store;
  #commands;
  #reads = new QuietReads();

  /** @param {{store: Store, commands: Commands}} context */
  constructor({ store, commands }) {
    this.#store = store;
    this.#commands = commands;
    setInterval(() => {
      const { recording, stream } = store.state;
      if (recording && stream !== "down" && !document.hidden) void this.#readOne(recording.id);
    }, EVERY_MS);
  }

  readAll() {
    return this.#reads.read("recordings", async () => {
      const found = /** @type {RecordingDocument[]} */ (await request("GET", "/recordings"));
      this.#store.set({ recording: found.find(isBeingMade) ?? null });
    });
  }

  /** @param {EventDocument} event */
  onEvent({ kind, data }) {
    if (!kind.startsWith("recording.")) return;
    if (kind === "recording.ended" && data?.["why"]) {
      this.#commands.notify({
        tone: "bad",
        title: `Recording “${String(data["name"])}” has ended early`,
        detail: String(data["why"]),
      });
    }
    if (kind === "recording.created" || kind === "recording.ended") void this.readAll();
  }

  /** @param {RecordingRequest} wish */
  async begin(wish) {
    const begun = await this.#commands.send("POST", "/recordings", { body: wish });
    if (begun) await this.readAll();
    return begun !== null;
  }

  /** End the recording; the response arrives when its file is complete. */
  async stop() {
    const { recording } = this.#store.state;
    if (!recording) return;
    this.#store.set({ recording: { ...recording, state: "ending" } });
    const path = recordingPath(recording.id, "/stop");
    const options = { patience_ms: 60_000 };
    const ended = /** @type {RecordingDocument | null} */ (await this.#commands.send("POST", path, options));
    if (ended && ended.why === "") {
      this.#commands.notify({
        tone: "good",
        title: `Recorded “${ended.name}”`,
        detail: tallyWords(ended),
        action: { label: "Show it", act: () => (location.hash = `#/gallery/recordings/${ended.id}`) },
      });
    }
    await this.readAll();
  }

  /** @param {string} id */
  #readOne(id) {
    return this.#reads.read("recording", async () => {
      let found = null;
      try {
        found = /** @type {RecordingDocument} */ (await request("GET", recordingPath(id)));
      } catch (error) {
        if (!(error instanceof RequestError) || error.slug !== "not-found") throw error;
      }
      const { recording } = this.#store.state;
      if (recording?.id !== id || (recording.state === "ending" && found?.state === "recording")) return;
      this.#store.set({ recording: found && isBeingMade(found) ? found : null });
    });
  }
}
