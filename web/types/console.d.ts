// What the modules of the console share: the types of the page, and what nearly each of them is given. No worker reads it.

export type * from "./page.d.ts";
export type { Commands } from "../foveacam_web/static/js/commands.js";
export type { Store } from "../foveacam_web/static/js/store.js";
