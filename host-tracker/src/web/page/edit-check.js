// What is wrong with the drawing, asked of the tracker after each change, and said at the field and beside the shape it is about.

import { html } from "./shapes.js";
import { trySite } from "./site-file.js";

/** After the last change, in ms. */
const AFTER_MS = 200;

export class Check {
  constructor(editor) {
    Object.assign(this, { editor, wrong: [], number: 0, timer: 0, checked: "" });
  }

  /** Asks, unless it has been asked about this drawing. */
  ask() {
    const site = JSON.stringify(this.editor.site);
    if (site === this.checked) return;
    this.checked = site;
    clearTimeout(this.timer);
    const number = ++this.number;
    this.timer = setTimeout(async () => {
      // Without an answer nothing is known to be wrong; saving says what is.
      const answer = await trySite({ site: JSON.parse(site) }).catch(() => ({ wrong: [] }));
      if (number !== this.number || !this.editor.open) return;
      this.wrong = answer.wrong;
      this.tell(document.getElementById("edit-form"));
      // In place: a shape that is made anew loses the focus.
      for (const { classList, dataset } of this.editor.layer.querySelectorAll(".shape")) {
        classList.toggle("wrong", this.of(dataset.kind, Number(dataset.index)).length > 0);
      }
    }, AFTER_MS);
  }

  /** Forgets what was wrong with another drawing. */
  clear() {
    this.number += 1;
    Object.assign(this, { wrong: [], checked: "" });
  }

  of(kind, index) {
    return this.wrong.filter((one) => one.kind === kind && one.index === index);
  }

  /** Says it in a form: at the fields of the chosen part, and in a list what is wrong with others. */
  tell(form) {
    if (!form) return;
    const { chosen } = this.editor;
    const own = chosen ? this.of(chosen.kind, chosen.index) : [];
    const said = new Set();
    for (const field of form.querySelectorAll("[data-key]")) {
      const wrong = own.find(({ key }) => key === field.dataset.key);
      if (wrong) said.add(wrong);
      const [input, words] = [field.querySelector("input, select"), field.querySelector(".wrong")];
      input.setAttribute("aria-invalid", String(Boolean(wrong)));
      words.textContent = wrong?.text ?? "";
      words.hidden = !wrong;
    }
    const list = form.querySelector("#edit-wrong");
    if (!list) return;
    list.replaceChildren(...this.wrong.filter((one) => !said.has(one)).map((one) => this.row(one)));
    list.hidden = !list.children.length;
  }

  row({ kind, index, text }) {
    const { chosen } = this.editor;
    const here = chosen?.kind === kind && chosen.index === index || !this.editor.part({ kind, index });
    const words = here ? text : html("button", {
      type: "button",
      className: "wrong-of",
      onclick: () => this.editor.choose({ kind, index }),
    }, text);
    return html("li", {}, words);
  }
}
