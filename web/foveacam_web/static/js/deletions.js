// Deletes entries of a list when the time to undo is over; until then they are hidden.

import { RequestError, request } from "./transport/api.js";

/** @import { Commands } from "#console" */

const UNDO_MS = 6000;

/** The deletions of one list. */
export class Deletions {
  #commands;
  #resource;
  #changed;
  /** @type {Set<string>} */
  #hidden = new Set();
  /** @type {Map<string, ReturnType<typeof setTimeout>>} */
  #timers = new Map();

  /**
   * @param {{commands: Commands, resource: string, changed: (hidden: string[], gone: string | null) => void}} context
   *   `resource`: the list's path below /api/v1; `changed`: called with the hidden entries and the one just deleted
   */
  constructor({ commands, resource, changed }) {
    this.#commands = commands;
    this.#resource = resource;
    this.#changed = changed;
    window.addEventListener("pagehide", () => this.#timers.forEach((_, id) => void this.#delete(id)));
  }

  /** @param {{id: string, label: string}} entry hidden now, deleted later */
  add({ id, label }) {
    this.#hidden.add(id);
    this.#timers.set(
      id,
      setTimeout(() => void this.#delete(id), UNDO_MS),
    );
    this.#notify();
    this.#commands.notify({
      tone: "info",
      title: `Deleted “${label}”`,
      detail: "",
      stay_ms: UNDO_MS,
      action: { label: "Undo", act: () => this.#restore(id) },
    });
  }

  /** @param {string} id */
  #restore(id) {
    clearTimeout(this.#timers.get(id));
    this.#timers.delete(id);
    this.#hidden.delete(id);
    this.#notify();
  }

  /** @param {string} id */
  async #delete(id) {
    clearTimeout(this.#timers.get(id));
    if (!this.#timers.delete(id)) return;
    const gone = await this.#commands.attempt(() =>
      request("DELETE", `${this.#resource}/${id}`, { keepalive: true }).then(
        () => true,
        (error) => {
          if (error instanceof RequestError && error.slug === "not-found") return true; // another page has deleted it
          throw error;
        },
      ),
    );
    this.#hidden.delete(id);
    this.#notify(gone ? id : null);
  }

  /** @param {string | null} [gone] */
  #notify(gone = null) {
    this.#changed([...this.#hidden], gone);
  }
}
