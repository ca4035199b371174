import { h } from "./dom.js";

export function create() {
  return h("section", {}, h("h2", {}, "Drive"));
}
