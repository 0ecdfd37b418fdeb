// A drawing that is not saved yet is kept in the browser: a page that is closed, a tracker that ends or a session that is over loses none.

const AFTER_MS = 500;
const key = (file) => `kehai-drawing:${file}`;

function write(file, text) {
  try {
    localStorage.setItem(key(file), text);
  } catch {
    // Without room there the page itself still has it.
  }
}

export class Draft {
  constructor() {
    Object.assign(this, { timer: 0, waits: null });
  }

  /** Keeps a drawing with the site it was made from. */
  keep({ file, revision, base, site }) {
    this.drop();
    const text = JSON.stringify({ revision, base, site, at_ms: Date.now() });
    this.waits = () => write(file, text);
    this.timer = setTimeout(() => this.now(), AFTER_MS);
  }

  /** Writes at once what waits: a moment later the page may not be there. */
  now() {
    const { waits } = this;
    this.drop();
    waits?.();
  }

  /** Nothing waits to be written any more. */
  drop() {
    clearTimeout(this.timer);
    this.waits = null;
  }

  /** Keeps again what was found, with which nothing was done yet. */
  restore(file, left) {
    this.drop();
    write(file, JSON.stringify(left));
  }

  /** Saved, or thrown away. */
  forget(file) {
    this.drop();
    try {
      localStorage.removeItem(key(file));
    } catch {
      // Nothing is kept there.
    }
  }

  /** What was drawn before this page, or null. */
  found(file) {
    try {
      return JSON.parse(localStorage.getItem(key(file)));
    } catch {
      return null;
    }
  }
}
