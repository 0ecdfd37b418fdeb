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
    this.timer = 0;
  }

  /** Keeps a drawing with the site it was made from. */
  keep({ file, revision, base, site }) {
    clearTimeout(this.timer);
    const text = JSON.stringify({ revision, base, site, at_ms: Date.now() });
    this.timer = setTimeout(() => write(file, text), AFTER_MS);
  }

  /** Keeps again what was found, with which nothing was done yet. */
  restore(file, left) {
    clearTimeout(this.timer);
    write(file, JSON.stringify(left));
  }

  /** Saved, or thrown away. */
  forget(file) {
    clearTimeout(this.timer);
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
