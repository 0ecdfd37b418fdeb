//! A name as every topic and identifier may hold it.
//!
//! ```text
//!   "Gate 1" ─▶ gate-1        "玄関" ─▶ u7384u95a2
//! ```

/// Letters and digits of ASCII in lower case, `-` for the rest of it, other letters by their number.
#[must_use]
pub fn slug(name: &str) -> String {
    let mut slug = String::new();
    for letter in name.chars() {
        if letter.is_ascii_alphanumeric() {
            slug.push(letter.to_ascii_lowercase());
        } else if letter.is_ascii() {
            slug.push('-');
        } else {
            slug.push_str(&format!("u{:x}", u32::from(letter)));
        }
    }
    slug
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slug_has_letters_digits_and_hyphens_alone() {
        assert_eq!(["Gate 1", "gate_1", "玄関"].map(slug), ["gate-1", "gate-1", "u7384u95a2"]);
    }
}
