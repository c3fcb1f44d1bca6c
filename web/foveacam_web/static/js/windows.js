// Starts the page of a window that shows any views, divided as its address says.

import { need } from "./dom.js";
import { openViewsPage } from "./video/page.js";
import { Board } from "./windows/board.js";

const page = openViewsPage();
new Board(need("panes"), page);
