// Where the keyboard is: the focus stays though elements are drawn anew, and goes along to a form that opens.

/** Draws what is in a layer anew; the one that has the focus, by its `data-` key, has it afterwards. */
export function keepFocus(layer, key, draw) {
  const { activeElement } = document;
  const focused = layer.contains(activeElement) ? activeElement.dataset?.[key] : undefined;
  draw();
  if (focused === undefined) return;
  [...layer.querySelectorAll(`[data-${key}]`)].find(({ dataset }) => dataset[key] === focused)?.focus();
}

/** Gives the focus to the heading of a form, which Tab alone does not reach. */
export function focusHeading(form) {
  const heading = form.querySelector("h2");
  if (!heading) return;
  heading.tabIndex = -1;
  heading.focus({ preventScroll: true });
}
