/** The page: header, login, and the panels, of which the address names the one that is shown. */

import * as devices from "./devices.js";
import { h, attribute } from "./dom.js";
import * as drive from "./drive.js";
import * as events from "./events.js";
import { watchHeader } from "./header.js";
import { watchLogin } from "./login.js";
import * as map from "./map.js";
import { showNotices } from "./notices.js";
import * as objects from "./objects.js";
import * as paths from "./paths.js";
import * as runs from "./runs.js";
import * as simulation from "./simulation.js";
import { watchOthers } from "./others.js";
import { station } from "./station.js";

const PANELS = {
  drive: ["Drive", drive],
  map: ["Map", map],
  devices: ["Devices", devices],
  events: ["Events", events],
  objects: ["Objects", objects],
  paths: ["Paths", paths],
  runs: ["Runs", runs],
  simulation: ["Simulation", simulation],
};
/** Width from which on the map stands beside the other panels, as in style.css. */
const WIDE = matchMedia("(min-width: 760px)");

const tabs = document.getElementById("tabs");
const main = document.getElementById("panels");
const shown = new Map();

function build() {
  for (const [name, [title, panel]] of Object.entries(PANELS)) {
    const element = panel.create(station);
    element.classList.add("panel");
    element.dataset.panel = name;
    element.setAttribute("aria-label", title);
    const tab = h("a", { href: `#${name}`, class: "tab", "data-tab": name }, title);
    tabs.append(tab);
    main.append(element);
    shown.set(name, { element, tab, title });
  }
}

/** Show the panel of the address; beside it the map, where there is room for both. */
function choose() {
  const asked = location.hash.slice(1);
  const name = shown.has(asked) && !(asked === "map" && WIDE.matches) ? asked : "drive";
  for (const [each, { element, tab, title }] of shown) {
    const chosen = each === name;
    element.hidden = !chosen && !(each === "map" && WIDE.matches);
    attribute(tab, "aria-current", chosen ? "page" : null);
    if (chosen) document.title = station.robot ? `${title} – ${station.robot}` : "canhelm station";
    if (chosen) tab.scrollIntoView({ block: "nearest", inline: "center" });
  }
}

showNotices(station);
watchHeader(station);
watchOthers(station);
build();
choose();
addEventListener("hashchange", () => {
  choose();
  main.focus({ preventScroll: true });
  scrollTo(0, 0);
});
WIDE.addEventListener("change", choose);
station.on("robot", choose);
station.start();
watchLogin(station);
