/** Boxes for numbers and choices: only good values are told, and what is wrong with others stands beside the box. */

import { attribute, h, text } from "./dom.js";

/** What is known of each box for a number: `agreed` is the text that it shared last with whoever owns the value. */
const boxes = new WeakMap();
let made = 0;

/**
 * A box for a number. One that is left with no good value keeps it, tells beside it what is wrong, and dispatches
 * `judged`, as it does when it is good again.
 *
 * @param label for people.
 * @param limits attributes such as min and max.
 * @param change is given the number; null for an empty box, where `limits.required` does not forbid that.
 * @param against why a number within the limits is no good one; "" where it is.
 */
export function field(label, limits, change, against = () => "") {
  const input = h("input", { type: "number", inputmode: "decimal", step: "any", "aria-label": label, ...limits });
  made += 1;
  boxes.set(input, { agreed: "", note: h("span", { class: "wrong", id: `wrong-${made}` }), against, change });
  for (const kind of ["change", "blur"]) input.addEventListener(kind, () => settle(input));
  return input;
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

/** A browser that takes nonsense for empty tells of no change: so this is asked for when the box is left, too. */
function settle(input) {
  const box = boxes.get(input);
  const untouched = input.value === box.agreed && !input.validity.badInput;
  const words = untouched ? "" : wordsAgainst(input);
  mark(input, words);
  if (untouched || words) return;
  box.agreed = input.value;
  box.change(input.value === "" ? null : input.valueAsNumber);
}

function mark(input, words) {
  const { note } = boxes.get(input);
  if (words === note.textContent) return;
  if (!note.isConnected) input.after(note);
  text(note, words);
  attribute(input, "aria-invalid", words ? "true" : null);
  attribute(input, "aria-describedby", words ? note.id : null);
  input.dispatchEvent(new Event("judged", { bubbles: true }));
}

function wordsAgainst(input) {
  const { validity, min, max, required, value, valueAsNumber } = input;
  const orEmpty = required ? "" : ", or leave it empty";
  if (validity.badInput) return "this is no number";
  if (validity.valueMissing) return "give a number";
  if (validity.rangeUnderflow) return `give at least ${min}${orEmpty}`;
  if (validity.rangeOverflow) return `give at most ${max}${orEmpty}`;
  return value === "" ? "" : boxes.get(input).against(valueAsNumber);
}
