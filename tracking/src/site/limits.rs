//! What a site may be at most: values beyond any real site, and values that would take all memory, are refused.
//!
//! A zone is divided into cells of 0.2 m, 24 bytes each; a place is at most ten kilometres from the origin.

use crate::site::Site;
use crate::site::reader::Reads;

/// Farthest place from the origin along each axis, m.
pub(crate) const FARTHEST_M: f64 = 10_000.0;

/// Area of all zones' bounding boxes together, m²: 5 million cells, 120 MB.
const ZONES_M2: f64 = 200_000.0;

/// What is too much or no place at all, as one sentence that names the part and what to do.
///
/// # Errors
/// The first found.
pub fn check(site: &Site) -> Result<(), String> {
    for module in &site.modules {
        if module.name.trim().is_empty() {
            return Err("a module has no name: give it its name or identity".to_owned());
        }
        places(&format!("module \"{}\"", module.name), &[[module.x, module.y]])?;
    }
    for (index, wall) in site.walls.iter().enumerate() {
        places(&format!("wall {}", index + 1), &wall.points)?;
    }
    let mut area_m2 = 0.0;
    for (index, zone) in site.zones.iter().enumerate() {
        if zone.name.trim().is_empty() {
            return Err(format!("zone {}: has no name", index + 1));
        }
        if site.zones.iter().take(index).any(|other| other.name == zone.name) {
            return Err(format!("two zones are named \"{}\": rename one", zone.name));
        }
        places(&format!("zone \"{}\"", zone.name), &zone.polygon)?;
        area_m2 += extent_m(&zone.polygon, 0) * extent_m(&zone.polygon, 1);
        if area_m2 > ZONES_M2 {
            return Err(format!(
                "zone \"{}\": all zones together are larger than {ZONES_M2} m²: make them smaller",
                zone.name
            ));
        }
    }
    for entry in &site.entries {
        places(&format!("entry \"{}\"", entry.name), &entry.line)?;
    }
    for mover in &site.movers {
        places(&format!("mover \"{}\"", mover.name), &mover.polygon)?;
    }
    for reader in &site.readers {
        if let Reads::Near { at, .. } = reader.reads {
            places(&format!("reader \"{}\"", reader.name), &[[at.x, at.y]])?;
        }
    }
    Ok(())
}

fn places(what: &str, places: &[[f64; 2]]) -> Result<(), String> {
    match places.iter().flatten().find(|metres| metres.is_nan() || metres.abs() > FARTHEST_M) {
        None => Ok(()),
        Some(metres) => {
            Err(format!("{what}: {metres} is no place: metres, at most {FARTHEST_M} from the origin"))
        }
    }
}

fn extent_m(polygon: &[[f64; 2]], axis: usize) -> f64 {
    let along = polygon.iter().filter_map(|corner| corner.get(axis).copied());
    let (low, high) =
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
    (high - low).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(text: &str) -> String {
        check(&toml::from_str(text).unwrap()).unwrap_err()
    }

    #[test]
    fn what_is_no_place_or_too_large_is_named() {
        assert!(said("[[wall]]\npoints = [[0, 0], [nan, 1]]").starts_with("wall 1: NaN is no place"));
        assert!(
            said("[[entry]]\nname = \"street\"\nline = [[0, 0], [inf, 1]]")
                .starts_with("entry \"street\": inf")
        );
        let large = "[[zone]]\nname = \"park\"\npolygon = [[0, 0], [1000, 0], [1000, 1000]]";
        assert!(said(large).starts_with("zone \"park\": all zones together are larger"));
        let zone = "[[zone]]\nname = \"a\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n";
        assert_eq!(said(&format!("{zone}{zone}")), "two zones are named \"a\": rename one");
    }
}
