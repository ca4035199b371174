/** What is told to people in passing; alarms stay until somebody has read them. */

import { h } from "./dom.js";

const SHOWN_MS = { info: 5000, warning: 12000, error: 20000 };
const WORDS = { info: "Note", warning: "Warning", error: "Error" };
const MOST = 3;

/** Show what `station.say` tells, from now on. */
export function showNotices(station) {
  const notes = document.getElementById("notes");
  const alarms = document.getElementById("alarms");
  station.on("said", (said) => add(said.severity === "error" ? alarms : notes, said));
}

function add(list, { text, severity, remedy }) {
  const same = [...list.children].find((notice) => notice.dataset.text === text);
  same?.remove();
  const close = h("button", { type: "button", class: "close", "aria-label": "Close this notice" }, "×");
  const words = h("p", {}, h("strong", {}, `${WORDS[severity]}: `), text, remedy && h("span", {}, ` – ${remedy}`));
  const notice = h("div", { class: `notice ${severity}`, "data-text": text }, words, close);
  close.addEventListener("click", () => notice.remove());
  list.append(notice);
  while (list.children.length > MOST) list.firstElementChild.remove();
  setTimeout(() => notice.remove(), SHOWN_MS[severity]);
}
