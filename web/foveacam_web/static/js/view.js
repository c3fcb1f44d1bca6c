// Starts the page that holds the views alone, for viser's panel: the console's modules without its panels.

import { need } from "./elements/dom.js";
import { openViewsPage } from "./video/page.js";

const { views } = openViewsPage();
need("wide").append(views.pane("wide").element);
need("eyes").append(views.pane("left").element, views.pane("right").element);
// In viser's panel the page around it has a STOP, which stays when the panel is folded
document.body.classList.toggle("framed", window.top !== window);
