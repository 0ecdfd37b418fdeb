// The editor among others: what they have saved is taken into the drawing, and what an earlier page has left is gone on with.

import { tellNews } from "./edit-form.js";
import { settle } from "./edit-merge.js";
import { typedIn } from "./edit-typing.js";
import { SELECT } from "./shapes.js";
import { trySite } from "./site-file.js";

export class Together {
  /** The tracker says that the site has another revision. */
  told(revision) {
    if (revision === this.revision || this.saving || this.conflicts) return;
    this.newer = true;
    // In place: somebody may be typing in the form.
    if (this.changed() || typedIn() || this.tool !== SELECT) tellNews(this);
    else this.takeIn();
  }

  /** Takes what others have saved into the drawing. */
  async takeIn() {
    try {
      const site = JSON.stringify(this.site), answer = await trySite(this);
      if (!this.open) return;
      if (JSON.stringify(this.site) === site) return this.take(answer);
      // What was drawn meanwhile is not in the answer: it is asked again when the visitor says so.
      this.newer = true;
      tellNews(this);
    } catch (error) {
      this.fail(error);
    }
  }

  /** Goes on with the drawing and what others have saved, as the tracker has put them together. */
  take({ revision, site, merged, conflicts, changes }) {
    Object.assign(this, { revision, base: site, site: merged, newer: false, taken: changes, drag: null });
    this.saved = JSON.stringify(site);
    // An undo beyond this would take away what others did.
    this.done = [];
    this.undone = [];
    this.chosen = null;
    this.conflicts = conflicts.length ? conflicts : null;
    // The corners set so far are no part of the site yet: only a question takes their place.
    if (this.conflicts) this.use(SELECT);
    else this.show();
  }

  /** Goes on with what was drawn while the text `sent` of the site was being saved as a revision; `merged`: with changes of others. */
  goOn(sent, revision, merged) {
    this.saved = sent;
    this.base = JSON.parse(sent);
    // With an older revision the next save keeps what others have changed.
    if (!merged) this.revision = revision;
    this.show();
    return merged ? this.takeIn() : undefined;
  }

  /** What both have changed is decided. */
  settled() {
    settle(this.site, this.conflicts);
    this.conflicts = null;
    this.show();
    document.getElementById("save")?.focus();
  }

  /** Goes on with the drawing that an earlier page has left. */
  takeUp() {
    const { revision, base, site } = this.left;
    Object.assign(this, { revision, base, site, left: null });
    return this.takeIn();
  }

  drop() {
    this.left = null;
    this.kept.forget(this.file);
    this.show();
  }

  fail(error) {
    this.error = error;
    this.show();
    this.error = null;
  }
}
