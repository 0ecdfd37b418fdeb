// What is being typed in the editor's form. A field tells its value only when it loses the focus, and the form is not made anew
// before that is done.
//
//   typed ─▶ Tab, a click, Ctrl+S ─▶ change: the part has the value ─▶ focus moved, pointer up ─▶ form made anew
//   made anew sooner, the field that Tab goes to, or the button that is pressed, would be gone: no focus, no click

/** Whether a field is typed in, not chosen from. */
export const isTyped = (field) => field.matches("input:not([type=checkbox])");

/** The field that is being typed in; none if the focus is elsewhere. */
export function typedIn() {
  const { activeElement } = document;
  return activeElement?.closest("#edit-form") && isTyped(activeElement) ? activeElement : null;
}

/** Takes in what is being typed; the field keeps the focus. */
export function takeTyped() {
  const field = typedIn();
  field?.blur();
  field?.focus({ preventScroll: true });
}

/** Calls `show` once after a change, when the focus has moved on and no pointer is pressed. */
export class Later {
  constructor(show) {
    Object.assign(this, { show, pressed: false, waiting: false });
    globalThis.addEventListener("pointerdown", () => this.pressed = true, true);
    // A list may keep the end of a press to itself: a key says as well that nothing is pressed.
    for (const end of ["pointerup", "pointercancel", "keydown"]) {
      globalThis.addEventListener(end, () => {
        this.pressed = false;
        this.after();
      }, true);
    }
  }

  /** What was to be shown is shown now. */
  done() {
    this.waiting = false;
  }

  soon() {
    this.waiting = true;
    this.after();
  }

  /** After all that the event under way does: its click, its focus. */
  after() {
    setTimeout(() => {
      if (!this.waiting || this.pressed) return;
      this.waiting = false;
      this.show();
    });
  }
}
