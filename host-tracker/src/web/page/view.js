// What part of the site is shown: moved by pointer, touch, wheel and keys. Site metres, y up, are SVG units with y down.

const CLICK_PX = 5;
const NEAREST = 0.002, FARTHEST = 1; // metres a pixel

export class View {
  /** `on.change` after every move, `on.click` with an element, and `on.down/move/up`, which take a pointer when true; `on.cancel` in the
   * place of `on.up` when a pointer that was taken is lost, or another one lands. */
  constructor(svg, on) {
    Object.assign(this, {
      svg,
      on,
      centre: [0, 0],
      px: 0.02,
      pointers: new Map(),
      moved: false,
      bounds: null,
      own: false,
    });
    svg.addEventListener("pointerdown", (event) => this.down(event));
    svg.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      svg.addEventListener(end, (event) => this.up(event));
    }
    svg.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(
        Math.exp(Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 120) / 400),
        this.place(event),
      );
    }, { passive: false });
    svg.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => (this.own || !this.bounds ? this.show() : this.fit(this.bounds))).observe(svg);
  }

  /** Shows all of [left, low, right, high]. */
  fit(bounds) {
    this.bounds = bounds;
    this.own = false;
    const { width, height } = this.svg.getBoundingClientRect();
    const [left, low, right, high] = bounds;
    // Room for the names at the edge, and for what lies over the map at the top and the bottom.
    const [side, top, bottom] = width < 500 ? [24, 24, 56] : [64, 72, 68];
    this.px = Math.max(
      (right - left) / Math.max(width - side, 50),
      (high - low) / Math.max(height - top - bottom, 50),
      NEAREST,
    );
    this.centre = [(left + right) / 2, (low + high) / 2 + ((top - bottom) / 2) * this.px];
    this.show();
  }

  show() {
    const { width, height } = this.svg.getBoundingClientRect();
    const [x, y] = this.centre;
    this.svg.setAttribute(
      "viewBox",
      `${x - width * this.px / 2} ${-y - height * this.px / 2} ${width * this.px || 1} ${
        height * this.px || 1
      }`,
    );
    this.svg.style.setProperty("--px", this.px);
    this.on.change();
  }

  /** What is shown: left, low, right, high. */
  shown() {
    const { width, height } = this.svg.getBoundingClientRect();
    const [x, y] = this.centre, [across, up] = [width, height].map((side) => side * this.px / 2);
    return [x - across, y - up, x + across, y + up];
  }

  /** The place in the site under a pointer. */
  place({ clientX, clientY }) {
    const box = this.svg.getBoundingClientRect();
    return [
      this.centre[0] + (clientX - box.left - box.width / 2) * this.px,
      this.centre[1] - (clientY - box.top - box.height / 2) * this.px,
    ];
  }

  zoom(factor, around = this.centre) {
    const px = Math.min(Math.max(this.px * factor, NEAREST), FARTHEST);
    const share = px / this.px;
    this.centre = this.centre.map((at, axis) => around[axis] + (at - around[axis]) * share);
    this.px = px;
    this.own = true;
    this.show();
  }

  pan(dx, dy) {
    this.centre = [this.centre[0] - dx * this.px, this.centre[1] + dy * this.px];
    this.own = true;
    this.show();
  }

  down(event) {
    if (event.button > 0) return;
    // All later events of this pointer arrive here.
    this.svg.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, event);
    // Two fingers move the map, also where they stay: none of them clicks.
    this.moved = this.pointers.size > 1;
    this.start = event;
    this.target = event.target;
    if (this.taken) this.on.cancel?.();
    this.taken = this.pointers.size === 1 && this.on.down?.(this.place(event), event);
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return this.on.move?.(this.place(event), event, false);
    if (Math.hypot(event.clientX - this.start.clientX, event.clientY - this.start.clientY) > CLICK_PX) {
      this.moved = true;
    }
    if (this.taken && this.pointers.size === 1) {
      this.on.move?.(this.place(event), event, this.moved);
    } else if (this.pointers.size === 1) {
      if (this.moved) {
        this.svg.classList.add("dragging");
        this.pan(event.clientX - before.clientX, event.clientY - before.clientY);
      }
    } else {
      this.pinch(event, before);
    }
    this.pointers.set(event.pointerId, event);
  }

  pinch(event, before) {
    const other = [...this.pointers.values()].find((pointer) => pointer.pointerId !== event.pointerId);
    const apart = (one) => Math.max(Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY), 1);
    this.moved = true;
    this.pan((event.clientX - before.clientX) / 2, (event.clientY - before.clientY) / 2);
    this.zoom(
      apart(before) / apart(event),
      this.place({
        clientX: (event.clientX + other.clientX) / 2,
        clientY: (event.clientY + other.clientY) / 2,
      }),
    );
  }

  up(event) {
    if (!this.pointers.delete(event.pointerId)) return;
    this.svg.classList.remove("dragging");
    const isLifted = event.type === "pointerup";
    if (this.taken && isLifted) this.on.up?.(this.place(event), event, this.moved);
    else if (this.taken) this.on.cancel?.();
    else if (!this.moved && isLifted) this.on.click?.(this.target);
    this.taken = false;
  }

  key(event) {
    if (event.target !== this.svg || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = 60;
    const does = {
      ArrowLeft: () => this.pan(step, 0),
      ArrowRight: () => this.pan(-step, 0),
      ArrowUp: () => this.pan(0, step),
      ArrowDown: () => this.pan(0, -step),
      "+": () => this.zoom(0.8),
      "=": () => this.zoom(0.8),
      "-": () => this.zoom(1.25),
      0: () => this.bounds && this.fit(this.bounds),
    }[event.key];
    if (does) {
      event.preventDefault();
      does();
    }
  }
}
