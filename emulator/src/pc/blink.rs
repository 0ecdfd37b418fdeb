//! A device on a PC has no LED: that it blinks is said on the terminal.
//!
//! ```text
//!   identify ─▶ "module … blinks: it is this one" ─▶ … ─▶ "module … blinks no more"
//! ```

use kehai::wire::ModuleId;

/// Whether it blinks, as far as has been said.
#[derive(Debug)]
pub struct Blink {
    /// The device, as it is called on the terminal.
    name: String,
    on: bool,
}

impl Blink {
    /// A device that does not blink.
    #[must_use]
    pub fn new(id: ModuleId, name: Option<&str>) -> Self {
        let name = name.map_or_else(|| id.to_string(), |name| format!("{name} ({id})"));
        Self { name, on: false }
    }

    /// What is to be said of it, if that is news.
    pub fn line(&mut self, identifying: bool) -> Option<String> {
        if identifying == self.on {
            return None;
        }
        self.on = identifying;
        let what = if identifying { "blinks: it is this one" } else { "blinks no more" };
        Some(format!("module {} {what}", self.name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_been_said_is_not_said_again() {
        let mut blink = Blink::new(ModuleId([2, 0, 0, 0, 0, 1]), Some("hall"));
        assert_eq!(blink.line(false), None);
        let name = "module hall (02:00:00:00:00:01)";
        assert_eq!(blink.line(true), Some(format!("{name} blinks: it is this one")));
        assert_eq!(blink.line(true), None);
        assert_eq!(blink.line(false), Some(format!("{name} blinks no more")));
        assert_eq!(blink.line(false), None);
    }
}
