/**
 * What is told to people in passing; errors stay longer, and what has a key until it is unsaid. A phone shows the first
 * alone, which is what stays wherever there is such, and says how many more there are.
 */

import { h, text } from "./dom.js";
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
  const counter = new MutationObserver(() => count(notes, alarms));
  for (const list of [notes, alarms]) counter.observe(list, { childList: true });
}

function count(...lists) {
  const more = lists.reduce((sum, list) => sum + list.childElementCount, -1);
  const element = document.getElementById("more-notices");
  element.hidden = more < 1;
  text(element, more < 1 ? "" : `and ${more} more`);
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
  list.insertBefore(notice, key ? list.firstChild : list.querySelector("[data-passing]"));
  if (key) return;
  notice.dataset.passing = "";
  const passing = list.querySelectorAll("[data-passing]");
  if (passing.length > MOST) passing[MOST].remove();
  setTimeout(() => notice.remove(), SHOWN_MS[severity]);
}
