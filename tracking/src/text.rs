//! Text that came over the network, made fit for a terminal, a log and a table.
//!
//! ```text
//!   "hall\x1b]0;owned\x07\n…" ─▶ "hall�]0;owned��…"
//! ```
//!
//! A device may say anything of itself. What would move a terminal's cursor, begin another line or turn the direction of
//! writing becomes U+FFFD, which is seen. Source: *Unicode* 17, general category Cc, chapters 5.8 (line ends) and 23.2
//! (directions).

/// The text with a U+FFFD for each character that is none to be read.
#[must_use]
pub fn printable(text: &str) -> String {
    text.chars().map(|letter| if is_read(letter) { letter } else { char::REPLACEMENT_CHARACTER }).collect()
}

fn is_read(letter: char) -> bool {
    let ends_line = matches!(letter, '\u{2028}' | '\u{2029}');
    let turns = matches!(letter, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    !(letter.is_control() || ends_line || turns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f12_what_moves_a_terminal_is_replaced_and_what_is_read_stays() {
        for (sent, read) in [
            ("\u{1b}]0;owned\u{7}", "\u{fffd}]0;owned\u{fffd}"),
            ("a\u{1b}[2Jb", "a\u{fffd}[2Jb"),
            ("a\r\nb\tc\0", "a\u{fffd}\u{fffd}b\u{fffd}c\u{fffd}"),
            ("\u{9b}31m\u{7f}", "\u{fffd}31m\u{fffd}"),
            ("\u{202e}llah\u{2028}", "\u{fffd}llah\u{fffd}"),
            ("Küche 2, 玄関 – «hall» 👋🏽", "Küche 2, 玄関 – «hall» 👋🏽"),
            ("", ""),
        ] {
            assert_eq!(printable(sent), read, "{sent:?}");
        }
    }
}
