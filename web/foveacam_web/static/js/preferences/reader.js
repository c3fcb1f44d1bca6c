// Reads the named settings that the server keeps, while their page is shown.

import { request } from "../transport/api.js";
import { QuietReads } from "../transport/quiet.js";

/**
 * @import { CameraPreset, WindowLayout } from "#api"
 * @import { Commands, Store } from "#console"
 */

const CHANGE_MS = 60_000; // each camera is stopped, set and started again

/** The reads and orders of one page. */
export class Preferences {
  #store;
  #commands;
  #reads = new QuietReads();

  /** @param {{store: Store, commands: Commands}} context */
  constructor({ store, commands }) {
    this.#store = store;
    this.#commands = commands;
    store.on(["settings_page"], () => void this.readAll());
  }

  readAll() {
    if (!this.#store.state.settings_page) return Promise.resolve();
    return this.#reads.read("presets", async () => {
      const [camera_presets, window_layouts] = await Promise.all([
        /** @type {Promise<CameraPreset[]>} */ (request("GET", "/cameras/presets")),
        /** @type {Promise<WindowLayout[]>} */ (request("GET", "/views/layouts")),
      ]);
      this.#store.set({ camera_presets, window_layouts });
    });
  }

  onEvent() {}

  /** @param {string} name */
  saveCameras(name) {
    return this.#order("PUT", `/cameras/presets/${encodeURIComponent(name)}`);
  }

  /** @param {string} name */
  async applyCameras(name) {
    const path = `/cameras/presets/${encodeURIComponent(name)}/apply`;
    const done = await this.#commands.send("POST", path, { patience_ms: CHANGE_MS });
    if (done) this.#commands.notify({ tone: "good", title: `The cameras are set as “${name}”`, detail: "" });
  }

  /** @param {string} name */
  deleteCameras(name) {
    return this.#order("DELETE", `/cameras/presets/${encodeURIComponent(name)}`);
  }

  /** @param {string} name @param {string} layout */
  saveLayout(name, layout) {
    return this.#order("PUT", `/views/layouts/${encodeURIComponent(name)}`, { layout });
  }

  /** @param {string} name */
  deleteLayout(name) {
    return this.#order("DELETE", `/views/layouts/${encodeURIComponent(name)}`);
  }

  /** @param {"PUT" | "DELETE"} method @param {string} path @param {object} [body] */
  async #order(method, path, body) {
    await this.#commands.send(method, path, { body });
    await this.readAll();
  }
}
