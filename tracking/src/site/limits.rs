//! What a site may be at most: values beyond any real site, and values that would take all memory, are refused.
//!
//! A zone is divided into cells of 0.2 m, 24 bytes each; a place is at most ten kilometres from the origin.

use crate::geometry::{Point, bounds};
use crate::site::Site;
use crate::site::part::Part;
use crate::site::reader::Reads;
use crate::site::wrong::{Wrongs, number};

/// Farthest place from the origin along each axis, m.
pub(crate) const FARTHEST_M: f64 = 10_000.0;

/// Area of all zones' bounding boxes together, m²: 5 million cells, 120 MB.
const ZONES_M2: f64 = 200_000.0;

/// What is read farther than this from everything in the site is read elsewhere, m: three times as far as any device sees, and less
/// than the smallest room in millimetres.
pub(crate) const BESIDE_M: f64 = 100.0;

/// Most corners of a polygon and of a wall. A room that is drawn by hand has some tens of them; each side is compared with each other
/// one, 33 000 times at most.
pub(crate) const CORNERS_MAX: usize = 256;

/// How far a place is from the upright rectangle around everything in the site, m; 0 within it, and in a site without anything.
pub(crate) fn beside_m(site: &Site, at: Point) -> f64 {
    let modules = site.modules.iter().map(|module| [module.x, module.y]);
    let walls = site.walls.iter().flat_map(|wall| &wall.points).copied();
    let zones = site.zones.iter().flat_map(|zone| &zone.polygon).copied();
    let entries = site.entries.iter().flat_map(|entry| &entry.line).copied();
    let lines = site.lines.iter().flat_map(|line| [line.from, line.to]);
    let points = modules.chain(walls).chain(zones).chain(entries).chain(lines).map(|[x, y]| Point::new(x, y));
    let readers = site.readers.iter().filter_map(|reader| match reader.reads {
        Reads::Near { at, .. } => Some(at),
        Reads::Pixels { .. } => None,
    });
    let floors = site.floors.iter().flat_map(|floor| {
        let across = Point::new(f64::from(floor.columns), f64::from(floor.rows)) * floor.pitch_m;
        [Point::default(), across].map(|corner| floor.corner().to_site(corner))
    });
    let Some((low, high)) = bounds(points.chain(readers).chain(floors)) else { return 0.0 };
    let beyond = |at: f64, low: f64, high: f64| (low - at).max(at - high).max(0.0);
    Point::new(beyond(at.x, low.x, high.x), beyond(at.y, low.y, high.y)).length()
}

/// Polygons and walls that have too many corners to be compared with anything.
pub(super) fn check_corners(site: &Site, said: &mut Wrongs) {
    check_lengths(&site.walls, "points", |wall| wall.points.len(), said);
    check_lengths(&site.zones, "polygon", |zone| zone.polygon.len(), said);
    check_lengths(&site.movers, "polygon", |mover| mover.polygon.len(), said);
    check_lengths(&site.excludes, "polygon", |exclude| exclude.polygon.len(), said);
}

fn check_lengths<P: Part>(parts: &[P], key: &'static str, length: impl Fn(&P) -> usize, said: &mut Wrongs) {
    for (index, part) in parts.iter().enumerate() {
        let corners = length(part);
        if corners > CORNERS_MAX {
            let what = format!("{key}: has {corners} corners: draw it with {CORNERS_MAX} at most");
            said.part(index, part, key, &what);
        }
    }
}

/// What is too much or no place at all.
pub(super) fn check(site: &Site, said: &mut Wrongs) {
    check_places(&site.modules, said);
    check_places(&site.walls, said);
    check_places(&site.zones, said);
    check_places(&site.entries, said);
    check_places(&site.movers, said);
    check_places(&site.excludes, said);
    check_places(&site.doors, said);
    check_places(&site.readers, said);
    let mut area_m2 = 0.0;
    for (index, zone) in site.zones.iter().enumerate() {
        area_m2 += extent_m(&zone.polygon, 0) * extent_m(&zone.polygon, 1);
        if area_m2 > ZONES_M2 {
            let what = format!("all zones together are larger than {ZONES_M2} m²: make them smaller");
            said.part(index, zone, "polygon", &what);
        }
    }
}

fn check_places<P: Part>(parts: &[P], said: &mut Wrongs) {
    for (index, part) in parts.iter().enumerate() {
        if let Some(what) = no_place(&part.corners()) {
            said.part(index, part, None, &what);
        }
    }
}

/// What is said of the first number that is no place, if there is one.
pub(super) fn no_place(places: &[[f64; 2]]) -> Option<String> {
    let metres = places.iter().flatten().find(|metres| metres.is_nan() || metres.abs() > FARTHEST_M)?;
    let metres = number(*metres);
    Some(format!("{metres} is no place: metres, at most {FARTHEST_M} from the origin"))
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
        let site: Site = toml::from_str(text).unwrap();
        site.check().unwrap_err()
    }

    #[test]
    fn a_place_is_within_everything_or_so_far_beside_it() {
        let text = "[[module]]\nname = \"m\"\nx = -1\ny = 0\n[[floor]]\nname = \"mat\"\nx = 0\ny = 0\ncolumns = 25\nrows = 25\n
            [[reader]]\nname = \"gate\"\nx = 5\ny = 8\nreach_m = 1\n";
        let site: Site = toml::from_str(text).unwrap();
        let off_m = |x, y| beside_m(&site, Point::new(x, y));
        assert_eq!([off_m(-1.0, 0.0), off_m(4.0, 7.0), off_m(8.0, 12.0)], [0.0, 0.0, 5.0]);
        assert_eq!(beside_m(&Site::default(), Point::new(1e9, 0.0)), 0.0);
    }

    #[test]
    fn a_polygon_or_a_wall_with_too_many_corners_is_the_only_thing_that_is_said() {
        let corners = |count: usize| -> String {
            let turn_rad = |corner: usize| corner as f64 / count as f64 * std::f64::consts::TAU;
            let corner =
                |corner| format!("[{:?}, {:?}]", libm::cos(turn_rad(corner)), libm::sin(turn_rad(corner)));
            (0..count).map(corner).collect::<Vec<_>>().join(", ")
        };
        let zone = |count| format!("[[zone]]\nname = \"a\"\npolygon = [{}]\n", corners(count));
        let site: Site = toml::from_str(&zone(CORNERS_MAX)).unwrap();
        assert_eq!(site.wrong(), []);
        // Both are named "a" and cross nothing; neither is looked at before they are shorter.
        let long = "polygon: has 257 corners: draw it with 256 at most";
        let site: Site = toml::from_str(&[zone(257), zone(3)].concat()).unwrap();
        let texts: Vec<String> = site.wrong().into_iter().map(|wrong| wrong.text).collect();
        assert_eq!(texts, [format!("zone \"a\": {long}")]);
        assert_eq!(
            said(&format!("[[wall]]\npoints = [{}]", corners(300))).split(": d").next(),
            Some("wall 1: points: has 300 corners")
        );
        for kind in ["mover", "exclude"] {
            let text = format!("[[{kind}]]\npolygon = [{}]", corners(257));
            assert_eq!(said(&text), format!("{kind} 1: {long}"));
        }
    }

    #[test]
    fn what_is_no_place_or_too_large_is_named() {
        assert!(said("[[wall]]\npoints = [[0, 0], [nan, 1]]").starts_with("wall 1: NaN is no place"));
        assert!(
            said("[[entry]]\nname = \"street\"\nline = [[0, 0], [inf, 1]]")
                .starts_with("entry \"street\": inf")
        );
        let door = "[[zone]]\nname = \"a\"\npolygon = [[0, 0], [1, 0], [1, 1]]\nsecure = true\n
            [[door]]\nname = \"front\"\nzone = \"a\"\nfail = \"safe\"\nline = [[0, 0], [1, 0]]\n";
        let far = door.replace("line = [[0, 0], [1, 0]]", "line = [[20000, 0], [20001, 0]]");
        assert!(said(&far).starts_with("door \"front\": 20000 is no place"), "{}", said(&far));
        let line = door.replace("line = [[0, 0]", "line = [[nan, 0]");
        assert!(said(&line).starts_with("door \"front\": NaN is no place"), "{}", said(&line));
        let line = door.replace("line = [[0, 0]", "line = [[-1e300, 0]");
        assert!(said(&line).starts_with("door \"front\": -1e300 is no place"), "{}", said(&line));
        let far = format!("{door}reader = [0, 1e9]\n");
        assert!(said(&far).starts_with("door \"front\": reader: 1000000000 is no place"), "{}", said(&far));
        let large = "[[zone]]\nname = \"park\"\npolygon = [[0, 0], [1000, 0], [1000, 1000]]";
        assert!(said(large).starts_with("zone \"park\": all zones together are larger"));
        let zone = "[[zone]]\nname = \"a\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n";
        assert_eq!(said(&format!("{zone}{zone}")), "two zones are named \"a\": rename one");
    }
}
