// Adds recordings from elsewhere: files of this computer, which are sent in parts, and files in folders of the server's.

import { RequestError, request } from "../../transport/api.js";
import { galleryAddress } from "../../addresses.js";
import { h, html, update } from "../../elements/dom.js";
import { dayTime, sentence } from "../../elements/format.js";
import { sizeWords } from "../gallery/dataset_words.js";
import { bar, textButton, toolButton } from "../../elements/parts.js";
import { recordOptions } from "../recording/options.js";
import { nameOf, sendRecording } from "./upload.js";

/**
 * @import { FolderFile, FoldersDocument, RecordingDocument } from "#api"
 * @import { Commands, Store } from "#console"
 * @typedef {{file: File, name: string, sent: number, refused: string, stop: AbortController}} Sending
 */

/**
 * @param {{store: Store, commands: Commands, signal: AbortSignal}} context
 */
export function makeImporter({ store, commands, signal }) {
  /** @type {Sending[]} */
  let sendings = [];
  /** @type {FoldersDocument | null} */
  let folders = null;
  let [open, how] = [false, false];
  const options = recordOptions({ store, signal });
  const element = h("div", { class: "importer stack" });
  const input = h("input", {
    type: "file",
    accept: ".fcap,.fovea",
    multiple: true,
    hidden: true,
    "aria-label": "Recording",
  });
  input.addEventListener("change", () => {
    const files = [...(input.files ?? [])];
    input.value = "";
    void sendAll(files);
  });
  const show = () =>
    update(
      element,
      html`<div class="actions">
          ${textButton("Send a recording …", () => input.click(), { picture: "up" })}
          ${textButton("On the server's machine", turn, { picture: "file", expanded: open })}
          ${textButton("How to record", unfold, { picture: "record", expanded: how })}
          <span class="why">.fcap or .fovea, ours or the authors', up to 256 GiB</span>
        </div>
        ${how && options}
        <ul class="sendings" role="status">${sendings.map(sendingOf)}</ul>
        ${open && foldersOf()}`,
    );
  const unfold = () => {
    how = !how;
    show();
  };
  const turn = async () => {
    open = !open;
    show();
    if (!open) return;
    folders = await commands.attempt(() => request("GET", "/recordings/folders"));
    show();
  };
  const sendAll = async (/** @type {File[]} */ files) => {
    const begun = files.map((file) => newSending(file, nameOf(file.name)));
    sendings = [...sendings, ...begun];
    show();
    for (const sending of begun) await send(sending);
  };
  const send = async (/** @type {Sending} */ sending) => {
    const onProgress = (/** @type {number} */ sent) => {
      sending.sent = sent;
      show();
    };
    try {
      const made = await sendRecording(sending.file, {
        name: sending.name,
        onProgress,
        cancelled: sending.stop.signal,
      });
      if (made) welcome(made);
      sendings = sendings.filter((one) => one !== sending);
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      sending.refused = error.message;
    }
    show();
  };
  const welcome = (/** @type {RecordingDocument} */ { id, name, state, why }) => {
    commands.notify({
      tone: state === "complete" ? "good" : "warn",
      title: `“${name}” is among the recordings`,
      detail: sentence(why),
      action: { label: "Show it", act: () => (location.hash = galleryAddress("recordings", id)) },
    });
  };
  const openFile = async (/** @type {FolderFile} */ { path }) => {
    const made = await commands.send("POST", "/recordings/open", { body: { path } });
    if (made) welcome(/** @type {RecordingDocument} */ (made));
    folders = await commands.attempt(() => request("GET", "/recordings/folders"));
    show();
  };
  const sendingOf = (/** @type {Sending} */ sending) => {
    const { file, name, sent, refused, stop } = sending;
    const { size } = file;
    const forget = () => {
      stop.abort();
      if (refused !== "") sendings = sendings.filter((one) => one !== sending);
      show();
    };
    const again = () => {
      const anew = newSending(file, sending.name);
      sendings = sendings.map((one) => (one === sending ? anew : one));
      show();
      void send(anew);
    };
    const far = `${sizeWords(sent)} of ${sizeWords(size)}`;
    return html`<li class="sending">
      <b>${name}</b>
      ${refused === "" ? html`<span class="why number">${far}</span>` : html`<span class="refused">${sentence(refused)}</span>`}
      ${toolButton(`${refused === "" ? "Cancel" : "Forget"} ${name}`, "close", forget)}
      ${
        refused !== "" &&
        html`<span class="actions">
          <input
            type="text" aria-label="Name of ${name}" maxlength="100" .value=${name}
            @input=${(/** @type {{target: HTMLInputElement}} */ { target }) => (sending.name = target.value)}
          />
          ${textButton("Send it under this name", again)}
        </span>`
      }
      ${refused === "" && bar(`Sending ${name}`, { share: size > 0 ? sent / size : null, text: far })}
    </li>`;
  };
  const foldersOf = () => {
    if (!folders) return html`<p class="why">Looking …</p>`;
    const missing = folders.folders.filter(({ found }) => !found);
    return html`<div class="folders stack">
      ${folders.files.length === 0 && html`<p class="empty">No recording lies in ${folders.folders.map(({ path }) => path).join(", ")}.</p>`}
      <ul class="folder-files">${folders.files.map((file) => fileOf(file))}</ul>
      ${!folders.complete && html`<p class="why">There are more: the newest are shown.</p>`}
      ${missing.map(({ path }) => html`<p class="why">${path}: there is no such folder, or it cannot be read.</p>`)}
      <p class="why">More folders: FOVEACAM_RECORDING_FOLDERS of the server. A recording that is opened stays where it lies.</p>
    </div>`;
  };
  const fileOf = (/** @type {FolderFile} */ file) =>
    html`<li>
      <span class="path" title=${file.path}>${file.path}</span>
      <span class="why number">${sizeWords(file.size_bytes)}, ${dayTime(file.modified_utc)}</span>
      ${textButton(file.opened ? "Opened" : "Open", () => openFile(file), { disabled: file.opened })}
    </li>`;
  signal.addEventListener("abort", () => sendings.forEach(({ stop }) => stop.abort()));
  show();
  return h("div", {}, input, element);
}

/** @param {File} file @param {string} name @returns {Sending} */
function newSending(file, name) {
  return { file, name, sent: 0, refused: "", stop: new AbortController() };
}
