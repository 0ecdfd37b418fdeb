//! A site is saved in the browser while four people are at home: no surface says that there are fewer.
//!
//! ```text
//!   hall with four people ─▶ kehai-tracker run ─┬─ map in Chromium   ◀─ another height, saved
//!                                               ├─ /api/state        ─┐
//!                                               ├─ /metrics           ├─ looked at a hundred times: four, or not known
//!                                               └─ lines on stdout   ─┘
//! ```

mod chromium;
mod described;
mod hall;
mod http_client;

use std::net::SocketAddr;
use std::process::Command;
use std::time::Duration;

use chromium::Page;
use hall::{Hall, Tracker};
use serde_json::Value;

/// Looks at the surfaces while the site is saved, and between two of them.
const LOOKS: usize = 100;
const BETWEEN: Duration = Duration::from_millis(50);

/// After how many looks a height is changed.
const SAVED_AT: [usize; 3] = [10, 40, 70];

const AT_HOME: u64 = 4;

/// What the surfaces say of the number of people; none: that it is not known.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Said {
    page: Option<u64>,
    state: Option<u64>,
    metrics: Option<u64>,
    zones: Option<u64>,
}

impl Said {
    fn by(page: &mut Page, server: SocketAddr) -> Self {
        let (_, state) = http_client::ask(server, "GET /api/state", &[], b"");
        let state: Value = serde_json::from_str(&state).unwrap();
        let zones = state["zones"].as_object().unwrap().values().map(|zone| zone["count"].as_u64());
        let (_, metrics) = http_client::ask(server, "GET /metrics", &[], b"");
        let people = metrics.lines().filter(|line| line.starts_with("kehai_zone_people{"));
        let people: Vec<u64> = people.map(|line| line.rsplit(' ').next().unwrap().parse().unwrap()).collect();
        let shown = page.value("document.querySelector('#total').textContent");
        Self {
            page: shown.as_str().unwrap().parse().ok(),
            state: state["total"]["count"].as_u64(),
            // A zone of which nothing is known has no sample.
            metrics: (people.len() == 2).then(|| people.iter().sum()),
            zones: zones.sum(),
        }
    }

    fn all(&self) -> [Option<u64>; 4] {
        [self.page, self.state, self.metrics, self.zones]
    }
}

fn save_height(page: &mut Page, height_m: &str) {
    page.click("#edit-open");
    page.wait("the tools are there", "!document.querySelector('#tools').hidden");
    page.value("document.querySelector('.shape[data-kind=module][data-index=\"0\"]').focus()");
    page.wait("its form is open", "document.querySelector('#part-height_m') !== null");
    page.value(
        "(() => { const field = document.querySelector('#part-height_m'); field.focus(); field.select(); })()",
    );
    page.write(height_m);
    page.key("Tab", 9);
    page.click("#save");
}

#[test]
fn a_height_is_saved_while_four_are_at_home_and_nowhere_are_there_fewer() {
    let Some(mut page) = chromium::start() else { return };
    let hall = Hall::new(7);
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
    command.args(hall.arguments(&hall.database)).args(["--http", "127.0.0.1:0"]);
    let tracker = Tracker::start(command);
    let map = tracker.says("live map at ");
    let server: SocketAddr = map.trim_start_matches("http://").trim_end_matches('/').parse().unwrap();
    page.size(1280, 800, 1);
    page.open(&map);
    page.wait("all four are there", &format!("document.querySelector('#total').textContent === '{AT_HOME}'"));
    let mut said = Vec::new();
    for look in 0..LOOKS {
        if let Some(number) = SAVED_AT.iter().position(|at| *at == look) {
            save_height(&mut page, &format!("0.{}", 5 + number));
        }
        said.push(Said::by(&mut page, server));
        std::thread::sleep(BETWEEN);
    }
    page.wait("the last is saved", "!document.body.classList.contains('editing')");
    let site = std::fs::read_to_string(&hall.site).unwrap();
    assert!(site.contains("height_m = 0.7"), "{site}");
    let fewer: Vec<(usize, &Said)> = said
        .iter()
        .enumerate()
        .filter(|(_, said)| said.all().into_iter().flatten().any(|people| people < AT_HOME))
        .collect();
    assert!(fewer.is_empty(), "{} of {LOOKS} looks: {fewer:#?}", fewer.len());
    let known = said.iter().filter(|said| said.all().iter().all(Option::is_some)).count();
    println!("{LOOKS} looks, of which {known} knew the number on every surface");
    assert!(known >= LOOKS / 2, "{known}");
    assert_eq!(page.errors, Vec::<String>::new());
}
