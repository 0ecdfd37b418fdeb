//! What is wrong with a part of a site: which part, which of its keys, and what to do.

use schemars::JsonSchema;
use serde::Serialize;

use super::part::{Kind, Part};

/// Something wrong with a part.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, JsonSchema)]
pub struct Wrong {
    /// What the part is.
    pub kind: Kind,
    /// Its number among those.
    pub index: usize,
    /// Which of its keys; null: its shape, or several.
    pub key: Option<&'static str>,
    /// A sentence that names the part and what to do.
    pub text: String,
}

/// All that is wrong, in the order in which it was found.
#[derive(Debug, Default)]
pub(super) struct Wrongs(pub Vec<Wrong>);

impl Wrongs {
    /// Notes what is wrong with a key of a part, as a sentence without its name.
    pub fn part<P: Part>(
        &mut self,
        index: usize,
        part: &P,
        key: impl Into<Option<&'static str>>,
        what: &str,
    ) {
        let text = format!("{}: {what}", part.label(index));
        self.0.push(Wrong { kind: P::KIND, index, key: key.into(), text });
    }

    /// Notes a whole sentence.
    pub fn say(&mut self, kind: Kind, index: usize, key: impl Into<Option<&'static str>>, text: String) {
        self.0.push(Wrong { kind, index, key: key.into(), text });
    }
}

/// A number as a sentence has it: one with hundreds of digits has its power of ten instead.
pub(super) fn number(value: f64) -> String {
    if value != 0.0 && value.is_finite() && !(1e-6..1e16).contains(&value.abs()) {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_short() {
        let said = [0.0, -0.5, 1e9, 1e300, -1e-300, f64::NAN, f64::INFINITY].map(number);
        assert_eq!(said, ["0", "-0.5", "1000000000", "1e300", "-1e-300", "NaN", "inf"]);
    }
}
