//! A page judged by axe-core: every rule of WCAG 2 A and AA, and best practice.
//!
//! ```text
//!   KEHAI_AXE=axe.js ─▶ run within the page, on the view that is shown ─▶ violations: none, or the test fails
//! ```
//!
//! `./ci.sh test` has the script from npm (`tests/axe.ts`); without it a developer's machine judges nothing.

use serde_json::json;

use super::Page;

impl Page {
    /// Fails on whatever axe-core finds wrong with the view that is shown now.
    ///
    /// # Panics
    /// On a violation; under CI without `KEHAI_AXE`, too.
    #[track_caller]
    pub fn is_accessible(&mut self, view: &str) {
        let Ok(axe) = std::env::var("KEHAI_AXE") else {
            assert!(
                std::env::var_os("CI").is_none(),
                "KEHAI_AXE names no script of axe-core: {view} is not judged"
            );
            return;
        };
        let axe = std::fs::read_to_string(axe).expect("KEHAI_AXE names a file");
        self.value(&format!("void (() => {{ if (!window.axe) {{ {axe} }} delete window.found; }})()"));
        self.value(
            "void axe.run().then((found) => window.found = found.violations.map((one) => one.id + one.nodes.map((node) => node.html).join()))",
        );
        self.wait("axe", "window.found !== undefined");
        assert_eq!(self.value("found"), json!([]), "{view}");
    }
}
