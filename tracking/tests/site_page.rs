//! `docs/site.md` is the reference of the site file: its example is a site, and it names every key that a site can have.

use kehai_tracking::site::Site;

const PAGE: &str = include_str!("../../docs/site.md");

/// A door with each of its keys; the example of the page has none.
const DOOR: &str = r#"
[[zone]]
name = "hall"
polygon = [[2, 0], [4, 0], [4, 2]]
secure = true

[[door]]
name = "front"
zone = "hall"
line = [[2, 0], [4, 0]]
fail = "secure"
reader = [2.5, 0.1]
"#;

fn example() -> &'static str {
    let (_, rest) = PAGE.split_once("```toml\n").expect("an example");
    rest.split_once("```").expect("the end of the example").0
}

/// Both kinds of readers.
const READERS: &str = r#"
[[reader]]
name = "near"
x = 0.0
y = 0.0
reach_m = 1.0

[[reader]]
name = "camera"
homography = [1, 0, 0, 0, 1, 0, 0, 0, 1]
"#;

/// A module with the keys that are left out where they say nothing.
const HUNG: &str = r#"
[[module]]
name = "hung"
x = 0.0
y = 0.0
upside_down = true
placed = false
"#;

const FLOOR: &str = r#"
[[floor]]
name = "mat"
x = 0.0
y = 0.0
columns = 24
rows = 24
"#;

#[test]
fn the_example_is_a_site() {
    let site = Site::parse("docs/site.md", example()).unwrap();
    assert_eq!((site.modules.len(), site.walls.len(), site.zones.len()), (1, 1, 1));
    assert_eq!((site.entries.len(), site.movers.len()), (1, 1));
}

#[test]
fn how_a_module_hangs_is_read_and_written() {
    let site = Site::parse("hung.toml", HUNG).unwrap();
    assert!(site.modules[0].upside_down && site.check().is_ok());
    let text = toml::to_string(&site).unwrap();
    assert!(text.contains("upside_down = true"), "{text}");
    assert_eq!(Site::parse("hung.toml", &text).unwrap(), site);
    let upright = Site::parse("upright.toml", &HUNG.replace("true", "false")).unwrap();
    assert!(
        !toml::to_string(&upright).unwrap().contains("upside_down"),
        "it is left out where it says nothing"
    );
    assert!(
        Site::parse("hung.toml", &HUNG.replace("true", "180"))
            .unwrap_err()
            .to_string()
            .contains("hung.toml:6")
    );
}

#[test]
fn the_page_names_every_key() {
    let site = Site::parse("docs/site.md", &format!("{}\n{DOOR}{READERS}{HUNG}", example())).unwrap();
    let floors = Site::parse("docs/site.md", FLOOR).unwrap().floors;
    let site = Site { floors, ..site };
    let toml::Value::Table(parts) = toml::Value::try_from(&site).unwrap() else {
        panic!("a site is a table")
    };
    for (part, items) in &parts {
        assert!(PAGE.contains(&format!("\n## {part}\n")), "docs/site.md has no section {part}");
        let tables = items.as_array().into_iter().flatten().filter_map(toml::Value::as_table);
        for key in tables.flat_map(toml::Table::keys) {
            assert!(PAGE.contains(&format!("`{key}`")), "docs/site.md does not name {part}.{key}");
        }
    }
}
