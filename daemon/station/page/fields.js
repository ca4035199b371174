/** Inputs that tell only good values, and are not overwritten while somebody writes in them. */

import { attribute, h } from "./dom.js";

/**
 * A number that is told when it has changed and is good.
 *
 * @param label for screen readers.
 * @param limits attributes such as min and max.
 * @param change is given the number; null for an empty field, where `limits.required` does not forbid that.
 */
export function field(label, limits, change) {
  const input = h("input", { type: "number", inputmode: "decimal", step: "any", "aria-label": label, ...limits });
  input.addEventListener("change", () => {
    const good = input.reportValidity();
    attribute(input, "aria-invalid", !good && "true");
    if (good) change(input.value === "" ? null : input.valueAsNumber);
  });
  return input;
}

/** One of several values with their names. */
export function choice(label, names, change) {
  const options = Object.entries(names).map(([value, name]) => h("option", { value }, name));
  const select = h("select", { "aria-label": label }, ...options);
  select.addEventListener("change", () => change(select.value));
  return select;
}

/** Show a value in an input, but for one that somebody may be writing in. */
export function put(input, value) {
  const writing = input.type === "number" && input === document.activeElement;
  if (writing || input.value === String(value)) return;
  input.value = value;
  attribute(input, "aria-invalid", null);
}
