// What is shown: the newest frame, or the time that the visitor looks back to, on the map, in the panel and in the tray.
//
//   frame, or history at a time ─▶ show ─▶ tracks, doors, states on the map · panel · tray
//   map moved, site changed     ─▶ redraw ─▶ what does not move · scale, then show

import { LINK } from "./names.js";
import { isKnown, ofNow } from "./shapes.js";
import { exactly } from "./words.js";

const TRAIL_MS = 12_000;
const PANEL_MS = 250;
const PLAYED_SMOOTHLY = 5; // times as fast as life

export class Showing {
  /** `state`: what is known and chosen; `parts` of the page, which show it. */
  constructor(state, parts) {
    Object.assign(this, { state, parts, shownAt: 0 });
  }

  /** Draws anew what depends on the site and on what of it is shown. */
  redraw() {
    const { state, parts: { drawing, doorMarks, view, editor, picture } } = this;
    const site = editor.open ? editor.site : state.site;
    const chosen = editor.open ? null : state.chosen;
    drawing.site(site, view.px, chosen?.module ?? null);
    doorMarks.site(site, view.px, chosen?.door ?? null);
    if (editor.open) editor.showShapes();
    if (picture.open) picture.draw();
    const length = [0.5, 1, 2, 5, 10, 20, 50].find((m) => m / view.px > 60) ?? 100;
    const scale = document.getElementById("scale");
    scale.firstElementChild.style.width = `${length / view.px}px`;
    scale.lastElementChild.textContent = exactly(length);
    this.show();
  }

  /** Shows the newest frame, or the time that the visitor looks back to; `quick`: the panel not each time. */
  show(quick = false) {
    const { state, parts: { time, past, panel, drawing, doorMarks, tray } } = this;
    const back = time.at !== null;
    const line = back ? time.lineAt(time.at) : state.frame;
    // The picture stays as it is until the answer for that time is here.
    document.body.classList.toggle("loading", line === null && back);
    if (line === null && back) return;
    const trail = back ? time.before(time.at, TRAIL_MS) : state.recent;
    const names = back ? new Map() : panel.where.names(state.frame);
    // What is played at once a time is placed, not walked.
    const walks = back ? time.playing && time.speed <= PLAYED_SMOOTHLY : true;
    const ms = !walks ? null : back ? performance.now() : line?.unix_ms ?? null;
    drawing.tracks(line?.tracks ?? [], trail, state.chosen?.person, names, ms);
    const known = isKnown(line, back || state.link === LINK.LIVE);
    const { modules, doors, floors, lines } = ofNow(state.frame, known && !back);
    drawing.panels(state.site, floors);
    drawing.crossed(lines);
    drawing.states(modules, known ? line.zones ?? {} : {});
    doorMarks.states(doors);
    tray.show(state.site, modules, known && !back);
    if (quick && performance.now() - this.shownAt < PANEL_MS) return;
    this.shownAt = performance.now();
    panel.show({
      site: state.site,
      line,
      modules,
      doors,
      chosen: state.chosen,
      known,
      past: back,
      events: back && past.kept ? past.eventsBefore(time.at) : [],
      passages: state.doors,
      names,
      frame: state.frame,
    });
  }
}
