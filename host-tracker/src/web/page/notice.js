// The line over the map: what is wrong, or for a while what was done.

const SAID_MS = 20_000;

const line = document.getElementById("notice");

/** Says it until something else is said; nothing takes the line away. */
export function notice(text) {
  line.textContent = text;
  line.classList.remove("said");
  line.hidden = !text;
}

/** Says what was done, for a while. */
export function tellDone(said) {
  notice(said);
  line.classList.add("said");
  tellDone.over = () => line.textContent === said && notice("");
  setTimeout(tellDone.over, SAID_MS);
}
