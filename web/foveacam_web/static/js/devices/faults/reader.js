// Keeps the list of faults equal to the server's, and adds what fails in this page itself.

import { QuietReads } from "../../transport/quiet.js";
import { withoutPresent, withPageFault } from "./words.js";

/**
 * @import { EventDocument, FaultDocument } from "#api"
 * @import { Commands, Store } from "#console"
 */

const LOST_MS = 600; // a shorter interruption is no fault
const LINK = "link";
const HARMLESS = /^ResizeObserver loop/; // a browser that lays out in two turns

/** The faults of one page. */
export class FaultReader {
  #store;
  #commands;
  #reads = new QuietReads();
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #lost;

  /** @param {{store: Store, commands: Commands}} context */
  constructor({ store, commands }) {
    this.#store = store;
    this.#commands = commands;
    window.addEventListener("error", (event) => this.#script(event.message, event.filename, event.lineno));
    window.addEventListener("unhandledrejection", ({ reason }) => this.#script(String(reason?.message ?? reason)));
    store.on(["stream", "signed_out"], (state) => this.#followLink(state));
  }

  readAll() {
    return this.#reads.keep(this.#store, "server_faults", "/faults");
  }

  /** @param {EventDocument} event */
  onEvent(event) {
    if (event.kind.startsWith("fault.")) void this.readAll();
  }

  /** Take a fault off the list. @param {FaultDocument} fault */
  async dismiss({ id }) {
    const { page_faults } = this.#store.state;
    if (page_faults.some((row) => row.id === id))
      this.#store.set({ page_faults: page_faults.filter((row) => row.id !== id) });
    else if (await this.#commands.send("DELETE", `/faults/${id}`)) await this.readAll();
  }

  /** Take all faults that are over off the list. */
  async dismissOver() {
    const { page_faults, server_faults } = this.#store.state;
    this.#store.set({ page_faults: page_faults.filter(({ present }) => present) });
    const over = server_faults.some(({ present }) => !present);
    if (over && (await this.#commands.send("DELETE", "/faults"))) await this.readAll();
  }

  /** @param {string} message @param {string} [file] @param {number} [line] */
  #script(message, file, line) {
    if (HARMLESS.test(message)) return;
    const place = file ? ` (${file.split("/").pop()}:${line})` : "";
    this.#add({
      scope: "page",
      name: "script",
      what: `${message}${place}`,
      remedy: "reload the page; when it stays, report it with the browser's console",
      lasting: false,
    });
  }

  /** @param {import("#page").ConsoleState} state */
  #followLink({ stream, signed_out }) {
    clearTimeout(this.#lost);
    if (stream === "open")
      this.#store.set({ page_faults: withoutPresent(this.#store.state.page_faults, LINK, new Date().toISOString()) });
    if (stream !== "down" || signed_out) return;
    this.#lost = setTimeout(
      () =>
        this.#add({
          scope: LINK,
          name: "server",
          what: "no connection to the server",
          remedy: "see whether it runs and the network holds; the page reconnects by itself",
          lasting: true,
        }),
      LOST_MS,
    );
  }

  /** @param {import("./words.js").PageFault} fault */
  #add(fault) {
    this.#store.set({ page_faults: withPageFault(this.#store.state.page_faults, fault, new Date().toISOString()) });
  }
}
