/** Numbers as people write them: with a decimal point, or with a comma. */

const DECIMAL = /^[-+]?(\d+[.,]?\d*|[.,]\d+)(e[-+]?\d+)?$/i;
const THOUSANDS = /^[-+]?[1-9]\d{0,2},\d{3}$/;

/** What to write in place of `1,500`, which is 1.5 for some people and 1500 for others; "" where that is clear. */
export function againstUnclear(written) {
  const digits = plain(written);
  return THOUSANDS.test(digits) ? `write ${digits.replace(",", ".")} or ${digits.replace(",", "")}` : "";
}

/** The number that somebody has written; NaN where it is none. */
export function parsed(written) {
  const digits = plain(written);
  return DECIMAL.test(digits) ? Number(digits.replace(",", ".")) : NaN;
}

/** With the minus sign of a keyboard, where the page's own one was copied. */
function plain(written) {
  return written.trim().replace("−", "-");
}
