// Button of the top bar with the signed-in user, its dialog, and the sentence for viewers.

import { PEOPLE_ADDRESS } from "../../addresses.js";
import { fill, h, html, setText, update } from "../../elements/dom.js";
import { dayTime } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { sheet } from "../../panels/dialogs.js";
import { passwordForm } from "./form.js";
import { VIEWER_WORDS, isNamed, may, roleWords, whoWords } from "./words.js";
import { textButton } from "../../elements/parts.js";

/**
 * @import { SignInDocument } from "#api"
 * @import { Commands, Store } from "#console"
 * @import { SessionReader } from "./reader.js"
 */

/**
 * Show who is signed in, in mode `open` nothing.
 * @param {{button: HTMLElement, strip: HTMLElement}} places
 * @param {{store: Store, commands: Commands, session: SessionReader}} context
 */
export function mountSession({ button, strip }, { store, commands, session }) {
  const [facts, password] = [h("div", {}), h("div", { class: "own-password" })];
  const dialog = sheet("Signed in", facts, password);
  const open = () => {
    fill(password);
    dialog.showModal();
  };
  const change = () => {
    const form = passwordForm(() => {
      dialog.close();
      commands.notify({ tone: "good", title: "Your password is changed", detail: "" });
    });
    fill(password, form);
    form.querySelector("input")?.focus();
  };
  store.on(["sign_in"], ({ sign_in }) => {
    const named = isNamed(sign_in);
    update(button, named && buttonOf(sign_in, open));
    update(facts, named && factsOf(sign_in, { change, leave: () => dialog.close(), session }));
    strip.hidden = !named || may(sign_in, "operate");
    setText(strip, VIEWER_WORDS);
  });
}

/** @param {SignInDocument} sign_in @param {() => void} open */
function buttonOf(sign_in, open) {
  const [who, { name }] = [whoWords(sign_in), roleWords(sign_in)];
  const title = `Signed in: ${who}, ${name.toLowerCase()}`;
  return html`<button type="button" class="tool session-button" aria-haspopup="dialog" aria-label=${title} title=${title} @click=${open}>
    ${icon("person")}<span class="who">${who}</span><span class="role">${name}</span>
  </button>`;
}

/** @param {SignInDocument} sign_in @param {{change: () => void, leave: () => void, session: SessionReader}} acts */
function factsOf(sign_in, { change, leave, session }) {
  const { name, does } = roleWords(sign_in);
  const { kind, expires_utc } = sign_in;
  const signOut = () => {
    leave();
    void session.signOut();
  };
  return html`<p class="session-who"><b>${whoWords(sign_in)}</b> ${name}: ${does}.</p>
    ${expires_utc && html`<p class="note">Signed in until ${dayTime(expires_utc)}.</p>`}
    <p class="actions">
      ${kind === "user" && textButton("Change password", change)}
      <a class="plain" href=${PEOPLE_ADDRESS} @click=${leave}>
        ${may(sign_in, "administer") ? "People and rights" : "My sign-ins"}
      </a>
      ${textButton("Sign out", signOut)}
    </p>`;
}
