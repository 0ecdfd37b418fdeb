//! Scenes that are part of the program, and scenes that change one of them.
//!
//! ```text
//!   base = "door-area"     ─▶  the base's table, key by key replaced by the scene's own;
//!   [gathering]                tables within tables likewise, lists as a whole
//!   people = 9
//! ```

/// Scenes that are part of the program, by the name of their file.
pub const BUILT_IN: &[(&str, &str)] = &[
    ("demo", include_str!("../../scenes/demo.toml")),
    ("building", include_str!("../../scenes/building.toml")),
    ("torso", include_str!("../../scenes/torso.toml")),
    ("empty", include_str!("../../scenes/empty.toml")),
    ("crossing", include_str!("../../scenes/crossing.toml")),
    ("passage", include_str!("../../scenes/passage.toml")),
    ("guarded", include_str!("../../scenes/guarded.toml")),
    ("door-area", include_str!("../../scenes/door-area.toml")),
    ("runners", include_str!("../../scenes/runners.toml")),
    ("home", include_str!("../../scenes/home.toml")),
    ("standing", include_str!("../../scenes/standing.toml")),
    ("one-of-two", include_str!("../../scenes/one-of-two.toml")),
    ("touching", include_str!("../../scenes/touching.toml")),
    ("together", include_str!("../../scenes/together.toml")),
    ("chair-back", include_str!("../../scenes/chair-back.toml")),
    ("chair-legs", include_str!("../../scenes/chair-legs.toml")),
    ("movers", include_str!("../../scenes/movers.toml")),
    ("suitcase", include_str!("../../scenes/suitcase.toml")),
    ("pushchair", include_str!("../../scenes/pushchair.toml")),
    ("wheelchair", include_str!("../../scenes/wheelchair.toml")),
    ("backpack", include_str!("../../scenes/backpack.toml")),
    ("crouching", include_str!("../../scenes/crouching.toml")),
    ("embracing", include_str!("../../scenes/embracing.toml")),
    ("facing", include_str!("../../scenes/facing.toml")),
    ("mirror", include_str!("../../scenes/mirror.toml")),
    ("child", include_str!("../../scenes/child.toml")),
    ("home-heights", include_str!("../../scenes/home-heights.toml")),
    ("home-things", include_str!("../../scenes/home-things.toml")),
    ("home-undeclared", include_str!("../../scenes/home-undeclared.toml")),
    ("home-sliding", include_str!("../../scenes/home-sliding.toml")),
    ("home-hard", include_str!("../../scenes/home-hard.toml")),
    ("hall", include_str!("../../scenes/hall.toml")),
    ("soak", include_str!("../../scenes/soak.toml")),
    ("flat", include_str!("../../scenes/flat.toml")),
];

/// The built-in scene that `own` names as its base, and that one's base, with the changes of `own`.
pub(super) fn on_its_base(own: toml::Table) -> Result<toml::Table, String> {
    let Some(base) = own.get("base").and_then(toml::Value::as_str) else { return Ok(own) };
    let text = BUILT_IN.iter().find(|(name, _)| *name == base).map(|(_, text)| *text);
    let text = text.ok_or_else(|| format!("base: no scene \"{base}\""))?;
    let table = toml::from_str(text).map_err(|error| format!("{base}: {}", error.message()))?;
    Ok(overlay(on_its_base(table)?, own))
}

/// `base` with the changes of `own`.
fn overlay(mut base: toml::Table, own: toml::Table) -> toml::Table {
    for (key, value) in own {
        let merged = match (base.remove(&key), value) {
            (Some(toml::Value::Table(base)), toml::Value::Table(own)) => {
                toml::Value::Table(overlay(base, own))
            }
            (_, value) => value,
        };
        base.insert(key, merged);
    }
    base
}
