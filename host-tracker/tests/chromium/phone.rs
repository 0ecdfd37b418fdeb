//! What a phone shows: 360 pixels across, light and dark, with text as it is and enlarged.
//!
//! With `KEHAI_VIEWS=1` each view is pictured under `target/`.
//!
//! ```text
//!   ├──────── 360 px ────────┤
//!   │ kehai             live │    every element's box lies between the edges, and no element
//!   │ [Calibrate] [Edit site]│    has more in it, across, than it shows
//! ```

use serde_json::json;

use super::Page;

/// The narrowest phone that is common, pixels.
const WIDTH: u32 = 360;

const HEIGHT: u32 = 780;

/// Text as it is, and as the setting "large text" of a phone makes it.
const TEXT_SCALES: [f64; 2] = [1.0, 1.3];

/// Size of text of the page without enlargement, pixels: 0.9375 rem of 16.
const TEXT_PX: f64 = 15.0;

/// Elements that reach over the edges or hide a part of their contents. What lies on the map may: it is moved by hand.
/// The contents of a field are scrolled by the cursor; what is within a picture has no box of its own to be hidden in, and must lie between
/// the edges.
const TOO_WIDE: &str = r##"(() => {
  const found = [];
  const name = (element) => `${element.tagName} #${element.id} .${element.getAttribute("class")}`;
  const page = document.documentElement.scrollWidth;
  if (page > WIDTH) found.push(`the page: ${page} px`);
  for (const element of document.querySelectorAll("body *")) {
    if (element.closest("#map, .skip, .for-screen-readers") || !element.getClientRects().length) continue;
    const { left, right } = element.getBoundingClientRect();
    if (left < -0.5 || right > WIDTH + 0.5) found.push(`${name(element)}: ${left} to ${right} px`);
    const hidden = element.scrollWidth - element.clientWidth;
    if (element.clientWidth && hidden > 1 && element.tagName !== "INPUT" && !element.ownerSVGElement) found.push(`${name(element)}: hides ${hidden} px`);
  }
  return found;
})()"##;

impl Page {
    /// Elements that are too wide for a phone, with their places.
    pub fn too_wide(&mut self) -> Vec<String> {
        self.settle();
        let found = self.value(&TOO_WIDE.replace("WIDTH", &WIDTH.to_string()));
        found.as_array().unwrap().iter().map(|element| element.as_str().unwrap().to_owned()).collect()
    }

    /// Gives the page a phone's size.
    pub fn phone(&mut self) {
        self.size(WIDTH, HEIGHT, 2);
    }

    /// Enlarges all text, as the operating system's setting does.
    pub fn enlarge_text(&mut self, scale: f64) {
        self.call("Emulation.setEmulatedOSTextScale", json!({ "scale": scale }));
    }

    /// Fails unless the view that is shown now fits a phone; then the page has its size of before again.
    #[track_caller]
    pub fn fits_a_phone(&mut self, view: &str) {
        let (width, height, dense) = self.metrics;
        self.phone();
        for scheme in ["light", "dark"] {
            self.scheme(scheme);
            for scale in TEXT_SCALES {
                self.enlarge_text(scale);
                let too_wide = self.too_wide();
                assert!(too_wide.is_empty(), "{view}, {scheme}, text × {scale}: {too_wide:#?}");
                let text = self.value("parseFloat(getComputedStyle(document.body).fontSize)");
                let off_px = text.as_f64().unwrap() - TEXT_PX * scale;
                assert!(off_px.abs() < 0.5, "text × {scale} is {text} px: it was not enlarged");
                if std::env::var_os("KEHAI_VIEWS").is_some() {
                    let name = format!("{}-{scheme}-{scale}.png", view.replace(' ', "-"));
                    self.picture(&std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name));
                }
            }
        }
        self.enlarge_text(1.0);
        self.is_accessible(&format!("{view}, phone, dark"));
        self.scheme("light");
        self.is_accessible(&format!("{view}, phone"));
        self.size(width, height, dense);
        self.wait("the page has its size again", &format!("innerWidth === {width}"));
    }
}
