// Firmware for new boards: which files this tracker hands out, and how each gets onto its board.

import { ask } from "./net.js";
import { html } from "./shapes.js";
import { who } from "./who.js";
import { number, say, tell, word } from "./words.js";

/** As the answer of the tracker says what a file is for. */
const PURPOSE = { DRIVE: "drive", DEBUGGER: "debugger" };
/** As probe-rs names the chip of a board. */
const CHIP = { "nucleo-h563zi": "STM32H563ZITx", "w5500-evb-pico2": "RP235x" };

/** The boards of a list of files, each with its files, and those of none. */
function boards(files) {
  const names = [...new Set(files.map(({ board }) => board).filter((board) => board !== null))];
  const of = (name) => files.filter(({ board }) => board === name);
  return { boards: names.map((name) => ({ name, files: of(name) })), others: of(null) };
}

/** How a board gets its firmware: sentences and commands, in their order. */
function steps({ name, files }) {
  const file = (purpose) => files.find((file) => file.purpose === purpose)?.name;
  if (file(PURPOSE.DRIVE)) return [{ say: "firmware.boot" }, { say: "firmware.drag" }];
  if (!file(PURPOSE.DEBUGGER) || !CHIP[name]) return [];
  const chip = `--chip ${CHIP[name]}`;
  return [
    { say: "firmware.cable" },
    {
      say: "firmware.write",
      run: `probe-rs download ${chip} --binary-format hex ${file(PURPOSE.DEBUGGER)}\nprobe-rs reset ${chip}`,
    },
  ];
}

function link({ name, bytes, purpose }, main) {
  const href = `/api/firmware/${encodeURIComponent(name)}`;
  const file = html("a", { className: "button", href, download: name }, name);
  file.classList.toggle("main", main);
  const size = say("firmware.size", { n: number(bytes / 1024) });
  return html("li", {}, file, html("span", { className: "fine" }, `${word("purpose", purpose)}, ${size}`));
}

const links = (files) =>
  html(
    "ul",
    { className: "files" },
    ...files.map((file, index) => link(file, file.board !== null && !index)),
  );

function section(board) {
  const step = ({ say: key, run }) => html("li", {}, say(key), ...run ? [html("pre", {}, run)] : []);
  return html(
    "section",
    { dataset: { board: board.name } },
    html("h2", {}, board.name),
    links(board.files),
    html("ol", {}, ...steps(board).map(step), html("li", {}, say("firmware.appears"))),
  );
}

function show({ files, folder, development_key }) {
  const found = boards(files);
  if (!found.boards.length) return [html("p", { id: "none" }, say("firmware.none", { folder }))];
  return [
    html("p", {}, say("firmware.once")),
    ...development_key
      ? [html("p", { className: "error", id: "development" }, say("firmware.development"))]
      : [],
    ...found.boards.map(section),
    ...found.others.length
      ? [html("section", {}, html("h2", {}, say("firmware.others")), links(found.others))]
      : [],
  ];
}

const content = document.getElementById("content");
who();
ask("/api/firmware").then((answer) => content.replaceChildren(...show(answer))).catch((error) => {
  const words = html("p", { className: "error", role: "alert" });
  content.replaceChildren(words);
  tell(words, error);
});
