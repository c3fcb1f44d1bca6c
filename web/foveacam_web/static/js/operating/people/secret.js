// Shows a secret that can be read only once: a link of an invitation, a token of a service.

import { copyCode } from "../../elements/copy.js";
import { html } from "../../elements/dom.js";
import { icon } from "../../elements/icons.js";
import { textButton } from "../../elements/parts.js";

/** @param {{title: string, text: string, note: string, done: () => void}} secret */
export function secretBox({ title, text, note, done }) {
  return html`<section class="copied secret" aria-label=${title}>
    <h4>${title}</h4>
    <pre>${text}</pre>
    <p class="note">${note}</p>
    <p class="actions">
      <button type="button" class="plain primary" @click=${copyCode}>${icon("file")}Copy</button
      ><span class="why" role="status"></span>
      ${textButton("Done", done)}
    </p>
  </section>`;
}
