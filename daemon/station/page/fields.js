/** Boxes for numbers and choices: only good values are told, and what is wrong with others stands beside the box. */

import { attribute, h, text } from "./dom.js";
import { againstUnclear, parsed } from "./numbers.js";

/** What is known of each box for a number: `agreed` is the text that it shared last with whoever owns the value. */
const boxes = new WeakMap();
let made = 0;

/**
 * A box for a number. One that is left with no good value keeps it, tells beside it what is wrong, and dispatches
 * `judged`, as it does when it is good again.
 *
 * @param label for people.
 * @param limits `min`, `max` and `whole` of the number, and attributes such as `required`.
 * @param change is given the number; null for an empty box, where `limits.required` does not forbid that.
 * @param against why a number within the limits is no good one; "" where it is.
 */
export function field(label, { min, max, whole, ...attributes }, change, against = () => "") {
  // the decimal keys of some phones have no minus
  const keys = min >= 0 ? "decimal" : "text";
  const written = { type: "text", class: "number", inputmode: keys, autocomplete: "off", spellcheck: "false" };
  const input = h("input", { ...written, "aria-label": label, ...attributes });
  made += 1;
  const note = h("span", { class: "wrong", id: `wrong-${made}` });
  const hint = input.getAttribute("aria-describedby");
  boxes.set(input, { agreed: "", note, hint, limits: { min, max, whole }, against, change });
  for (const kind of ["change", "blur"]) input.addEventListener(kind, () => settle(input));
  return input;
}

/** Let a box have other limits, `min` and `max`. */
export function limit(input, limits) {
  Object.assign(boxes.get(input).limits, limits);
}

/** The number in a box; null in an empty one. */
export function numberIn(input) {
  return input.value === "" ? null : parsed(input.value);
}

/** One of several values with their names. */
export function choice(label, names, change) {
  const options = Object.entries(names).map(([value, name]) => h("option", { value }, name));
  const select = h("select", { "aria-label": label }, ...options);
  select.addEventListener("change", () => change(select.value));
  return select;
}

/** Show a value, but where somebody is writing, or has written what is wrong and the value is the one from before. */
export function put(input, value) {
  const [box, told] = [boxes.get(input), String(value)];
  if (box && input === document.activeElement) return;
  if (box && !input.disabled && isWrong(input) && told === box.agreed) return;
  if (box) box.agreed = told;
  if (input.value !== told || isWrong(input)) input.value = told;
  if (box) mark(input, "");
}

/** Take what stands in the box that somebody is writing in as if they had left it. */
export function settleWriting() {
  if (boxes.has(document.activeElement)) settle(document.activeElement);
}

/** What is wrong with the first wrong box within an element, in words; null where all are good. */
export function wrongIn(element) {
  const input = wrongBoxes(element)[0];
  return input ? `${input.getAttribute("aria-label")}: ${boxes.get(input).note.textContent}` : null;
}

/** Let all wrong boxes within an element show what they held before; whether there were any. */
export function putBack(element) {
  const wrong = wrongBoxes(element);
  for (const input of wrong) {
    input.value = boxes.get(input).agreed;
    mark(input, "");
  }
  return wrong.length > 0;
}

function wrongBoxes(element) {
  return [...element.querySelectorAll("input")].filter((input) => boxes.has(input) && isWrong(input));
}

function isWrong(input) {
  return input.getAttribute("aria-invalid") === "true";
}

/** What was taken stands in the box as the page writes it: what was `1,5` is `1.5` from then on. */
function settle(input) {
  const box = boxes.get(input);
  const untouched = input.value === box.agreed;
  const words = untouched ? "" : wordsAgainst(input);
  mark(input, words);
  if (untouched || words) return;
  const value = numberIn(input);
  input.value = box.agreed = String(value ?? "");
  box.change(value);
}

function mark(input, words) {
  const { note, hint } = boxes.get(input);
  if (words === note.textContent) return;
  if (!note.isConnected) input.after(note);
  text(note, words);
  attribute(input, "aria-invalid", words ? "true" : null);
  attribute(input, "aria-describedby", words ? [hint, note.id].filter(Boolean).join(" ") : hint);
  input.dispatchEvent(new Event("judged", { bubbles: true }));
}

function wordsAgainst(input) {
  const { limits, against } = boxes.get(input);
  const { min, max, whole } = limits;
  if (input.value === "") return input.required ? "give a number" : "";
  const value = parsed(input.value);
  const orEmpty = input.required ? "" : ", or leave it empty";
  if (!Number.isFinite(value)) return "this is no number";
  if (whole && !Number.isInteger(value)) return `give a whole number${orEmpty}`;
  if (value < (min ?? -Infinity)) return `give at least ${min}${orEmpty}`;
  if (value > (max ?? Infinity)) return `give at most ${max}${orEmpty}`;
  return againstUnclear(input.value) || against(value);
}
