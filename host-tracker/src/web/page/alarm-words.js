// What an alarm says: of the kind and what to do, in the visitor's language; in English with the figures of the moment.

import { ABOUT } from "./names.js";
import { language, say, word } from "./words.js";

/** What is wrong and what to do. The tracker's own sentence has figures, and is English. */
export const alarmText = ({ name, text }) =>
  language === "en" ? text : say("alarm.told", { what: word("alarm", name), remedy: word("remedy", name) });

/** What an alarm is about. */
export const sayAbout = ({ source, of }) =>
  source === ABOUT.TRACKER ? say("about.tracker") : say(`about.${source}`, { name: of });
