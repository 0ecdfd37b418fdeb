// The site file on the tracker: read, tried and changed. What others have saved meanwhile is kept.

import { ask, send } from "./net.js";

const TRIES = 3; // others may save the same part, too

/** The site and its revision. */
export const readSite = () => ask("/api/site");

/** What is wrong with a site, and, with the one it was made from, how it goes together with the newest; nothing is saved. */
export const trySite = ({ base, site }) => send("POST", "/api/site/try", { base, site });

/** Saves a site that was made from another one, of a revision; refused where both have changed the same part. */
export const saveSite = ({ revision, base, site }) => send("PUT", "/api/site", { revision, base, site });

/** Changes the site as it is now by `change`, which may be called again with a newer one; the answer has the new revision. What changes
 * nothing is not saved: a save is a version of the site, and for a moment no number matches at its doors. */
export async function changeSite(change) {
  for (let tries = 1;; tries++) {
    const { site: base, revision } = await readSite();
    const site = structuredClone(base);
    change(site);
    if (JSON.stringify(site) === JSON.stringify(base)) return { revision };
    try {
      return await saveSite({ revision, base, site });
    } catch (error) {
      if (tries === TRIES || error.status !== 409) throw error;
    }
  }
}
