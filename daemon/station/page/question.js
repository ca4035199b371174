/** A question in the page itself; one in a window of its own would keep the stop waiting. */

import { h, text } from "./dom.js";

/** Hidden until something is asked; `element` goes below what it is about. */
export class Question {
  #words = h("p");
  #yes = h("button", { type: "button", onclick: () => this.#answer(true) });
  #no = h("button", { type: "button", onclick: () => this.#answer(false) }, "Cancel");
  #act = null;
  #asker = null;

  constructor(label) {
    const attributes = { class: "question", role: "group", "aria-label": label, hidden: true };
    this.element = h("div", attributes, this.#words, this.#yes, this.#no);
  }

  /**
   * Ask, and do something if the answer is yes.
   *
   * @param words the question.
   * @param verb what the button says that means yes.
   * @param act does it.
   */
  ask(words, verb, act) {
    [this.#act, this.#asker] = [act, document.activeElement];
    text(this.#words, words);
    text(this.#yes, verb);
    this.element.hidden = false;
    this.#no.focus();
  }

  /** Take the question back. */
  close() {
    this.element.hidden = true;
    this.#act = null;
  }

  #answer(yes) {
    const act = this.#act;
    this.close();
    this.#asker?.focus();
    if (yes) act?.();
  }
}
