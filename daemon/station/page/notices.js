/** What is told to people in passing; errors stay longer, and what has a key until it is unsaid. */

import { h } from "./dom.js";
import { inPageWords } from "./words.js";

const SHOWN_MS = { info: 5000, warning: 12000, error: 20000 };
const WORDS = { info: "Note", warning: "Warning", error: "Error" };
const MOST = 3;

/** Show what `station.say` tells, from now on. */
export function showNotices(station) {
  const notes = document.getElementById("notes");
  const alarms = document.getElementById("alarms");
  station.on("said", (said) => add(said.severity === "error" ? alarms : notes, said));
  station.on("unsaid", (key) => find(alarms, key)?.remove());
}

function find(list, key) {
  return [...list.children].find((notice) => notice.dataset.key === key);
}

function add(list, { text, severity, remedy, key }) {
  find(list, key ?? text)?.remove();
  const close = h("button", { type: "button", class: "close", "aria-label": "Close this notice" }, "×");
  const words = h("p", {}, h("strong", {}, `${WORDS[severity]}: `), inPageWords(text),
    remedy && h("span", {}, ` – ${inPageWords(remedy)}`));
  const notice = h("div", { class: `notice ${severity}`, "data-key": key ?? text }, words, close);
  close.addEventListener("click", () => notice.remove());
  list.prepend(notice);
  if (key) return;
  notice.dataset.passing = "";
  const passing = list.querySelectorAll("[data-passing]");
  if (passing.length > MOST) passing[MOST].remove();
  setTimeout(() => notice.remove(), SHOWN_MS[severity]);
}
