// Starts the page of a window that shows any views, in the layout given by its address.

import { decoded } from "./addresses.js";
import { need } from "./elements/dom.js";
import { openViewsPage } from "./video/page.js";
import { Board } from "./operating/windows/board.js";
import { keepLayout } from "./operating/windows/last_layout.js";
import { layoutOf, layoutText } from "./operating/windows/layout.js";
import { Slot, titleOf } from "./operating/windows/slot.js";

const page = openViewsPage();
const board = new Board(need("panes"), {
  make: (source, acts) => new Slot(source, { ...page, acts }),
  keep: {
    read: () => layoutOf(decoded(location.hash.slice(1)) ?? ""),
    write: (layout) => {
      keepLayout(layout);
      history.replaceState(null, "", `#${layoutText(layout)}`);
    },
    shown: (sources) => (document.title = `${sources.map(titleOf).join(", ")}: FoveaCam Duo`),
  },
});
addEventListener("hashchange", () => board.read());
