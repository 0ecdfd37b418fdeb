//! A merge drops nothing that a user drew, and asks only where it has to.

use proptest::prelude::*;

use super::*;
use crate::site::{Wall, Zone};

fn site(text: &str) -> Site {
    toml::from_str(text).unwrap()
}

const HALL: &str = "[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [4, 0], [4, 4]]\n";
const STUDY: &str = "[[zone]]\nname = \"study\"\npolygon = [[5, 0], [9, 0], [9, 4]]\n";
const WALL: &str = "[[wall]]\npoints = [[0, 0], [4, 0]]\n";

fn names(site: &Site) -> Vec<&str> {
    site.zones.iter().map(|zone| zone.name.as_str()).collect()
}

#[test]
fn changes_of_different_parts_are_both_kept() {
    let base = site(&[HALL, STUDY, WALL].concat());
    let mut mine = base.clone();
    mine.zones[0].polygon[2] = [4.0, 5.0];
    mine.zones.push(site(&HALL.replace("hall", "mine")).zones.remove(0));
    let mut theirs = base.clone();
    theirs.zones[1].name = "library".into();
    theirs.walls[0].points[1] = [6.0, 0.0];
    theirs.zones.insert(0, site(&HALL.replace("hall", "theirs").replace("4]]", "7]]")).zones.remove(0));
    let Merged { site: both, conflicts } = merge(&base, &mine, &theirs);
    assert_eq!(conflicts, []);
    assert_eq!(names(&both), ["theirs", "hall", "library", "mine"]);
    assert_eq!((both.zones[1].polygon[2], both.walls[0].points[1]), ([4.0, 5.0], [6.0, 0.0]));
    assert_eq!(
        changes(&base, &theirs),
        ["wall 1 changed", "zone \"library\" changed", "zone \"theirs\" added"]
    );
}

#[test]
fn a_module_that_one_edit_turns_over_stays_so_beside_the_others() {
    let base = site(&[HALL, "[[module]]\nname = \"left\"\nx = 1.0\ny = 2.0\n"].concat());
    let (mut mine, mut theirs) = (base.clone(), base.clone());
    mine.modules[0].upside_down = true;
    theirs.zones[0].name = "lounge".into();
    let Merged { site: both, conflicts } = merge(&base, &mine, &theirs);
    assert_eq!((conflicts, names(&both)), (vec![], vec!["lounge"]));
    assert!(both.modules[0].upside_down);
    assert_eq!(changes(&base, &mine), ["module \"left\" changed"]);
    theirs.modules[0].x = 3.0;
    assert_eq!(merge(&base, &mine, &theirs).conflicts.len(), 1);
}

#[test]
fn what_both_changed_is_asked_for_with_both() {
    let base = site(&[HALL, STUDY].concat());
    let (mut mine, mut theirs) = (base.clone(), base.clone());
    mine.zones[0].polygon[2] = [4.0, 5.0];
    theirs.zones[0].polygon[2] = [4.0, 6.0];
    mine.zones.remove(1);
    theirs.zones[1].count = true;
    let Merged { site: both, conflicts } = merge(&base, &mine, &theirs);
    let [hall, study] = &conflicts[..] else { panic!("{conflicts:?}") };
    assert_eq!((hall.kind, hall.label.as_str(), hall.index), (Kind::Zone, "zone \"hall\"", 0));
    assert_eq!(hall.mine.as_ref().unwrap()["polygon"][2][1], 5.0);
    assert_eq!(hall.theirs.as_ref().unwrap()["polygon"][2][1], 6.0);
    assert_eq!((study.index, &study.mine), (1, &None));
    assert_eq!((both.zones[0].polygon[2], names(&both)), ([4.0, 5.0], vec!["hall", "study"]));
}

#[test]
fn two_new_parts_of_one_name_are_asked_for_and_the_same_one_is_one() {
    let base = site(HALL);
    let [mine, theirs] =
        ["[9, 4]", "[9, 5]"].map(|corner| site(&[HALL, &STUDY.replace("[9, 4]", corner)].concat()));
    assert_eq!(merge(&base, &mine, &theirs).conflicts.len(), 1);
    assert_eq!(merge(&base, &mine, &mine), Merged { site: mine.clone(), conflicts: vec![] });
    let both_and_another = merge(&base, &mine, &site(&[HALL, STUDY, WALL].concat()));
    assert_eq!((both_and_another.conflicts.len(), names(&both_and_another.site)), (0, vec!["hall", "study"]));
}

/// What one edit does: which part, what to it, with what.
type Edit = (u8, u8, u8);

/// Few names and few places, so that edits meet.
fn edited(base: &Site, edits: &[Edit]) -> Site {
    let mut site = base.clone();
    for &(which, what, with) in edits {
        let corner = [f64::from(with % 4), f64::from(with / 4 % 4)];
        let is_wall = which % 2 == 0;
        let number =
            usize::from(which / 2) % if is_wall { site.walls.len() } else { site.zones.len() }.max(1);
        match (what % 4, is_wall) {
            (0, true) => site.walls.push(Wall { points: vec![corner, [9.0, 9.0]], ..site_wall() }),
            (0, false) => {
                site.zones.push(Zone { polygon: vec![corner, [8.0, 0.0], [8.0, 8.0]], ..site_zone(with) })
            }
            (1, true) if number < site.walls.len() => {
                site.walls.remove(number);
            }
            (1, false) if number < site.zones.len() => {
                site.zones.remove(number);
            }
            (2, true) => site.walls.iter_mut().skip(number).take(1).for_each(|wall| wall.points[0] = corner),
            (2, false) => {
                site.zones.iter_mut().skip(number).take(1).for_each(|zone| zone.polygon[0] = corner)
            }
            (_, true) => {
                site.walls.iter_mut().skip(number).take(1).for_each(|wall| wall.mirror = !wall.mirror)
            }
            (_, false) => site.zones.iter_mut().skip(number).take(1).for_each(|zone| zone.name = name(with)),
        }
        // As a check of the site asks: each name once.
        let mut seen = Vec::new();
        site.zones.retain(|zone| {
            let is_new = !seen.contains(&zone.name);
            seen.push(zone.name.clone());
            is_new
        });
    }
    site
}

fn name(with: u8) -> String {
    char::from(b'a' + with % 6).to_string()
}

fn site_wall() -> Wall {
    site(WALL).walls.remove(0)
}

fn site_zone(with: u8) -> Zone {
    Zone { name: name(with), ..site(HALL).zones.remove(0) }
}

/// How often a part is in a list.
fn count<P: Part>(list: &[P], part: &P) -> usize {
    list.iter().filter(|other| *other == part).count()
}

/// Every part that an edit drew or changed is in the merged site, or asked for.
fn nothing_is_dropped<P: Part>(base: &[P], edit: &[P], merged: &[P], asked: &[&Value]) {
    for part in edit.iter().filter(|part| count(base, part) == 0) {
        let text = serde_json::to_value(part).unwrap();
        assert!(count(merged, part) > 0 || asked.contains(&&text), "{text} is lost");
    }
}

/// What neither has touched is there. Of two equal walls each may have changed another, and then none is left.
fn the_same_stays<P: Part>([base, mine, theirs]: [&[P]; 3], merged: &[P]) {
    for part in base {
        let of_base = count(base, part);
        let touched = |edit| of_base.saturating_sub(count(edit, part));
        let kept = of_base.saturating_sub(touched(mine) + touched(theirs));
        let is_kept = count(merged, part) >= kept;
        assert!(is_kept, "{} is there less than {kept} times", part.label(0));
    }
}

#[test]
fn of_two_equal_walls_one_taken_away_and_the_other_moved_none_is_left() {
    let other = WALL.replace("[4, 0]", "[4, 9]");
    let base = site(&[WALL, &other, WALL].concat());
    let (mut mine, mut theirs) = (base.clone(), base.clone());
    mine.walls.remove(2);
    theirs.walls[0] = base.walls[1].clone();
    let Merged { site: both, conflicts } = merge(&base, &mine, &theirs);
    assert_eq!((both.walls, conflicts), (vec![base.walls[1].clone(); 2], vec![]));
}

proptest! {
    #[test]
    fn whatever_two_do_nothing_is_lost(
        first in proptest::collection::vec(any::<Edit>(), 0..8),
        one in proptest::collection::vec(any::<Edit>(), 0..6),
        other in proptest::collection::vec(any::<Edit>(), 0..6),
    ) {
        let base = edited(&site(&[HALL, WALL].concat()), &first);
        let (mine, theirs) = (edited(&base, &one), edited(&base, &other));
        let both = merge(&base, &mine, &theirs);
        let asked = |of: fn(&Conflict) -> &Option<Value>| -> Vec<&Value> {
            both.conflicts.iter().filter_map(|conflict| of(conflict).as_ref()).collect()
        };
        let (of_mine, of_theirs) = (asked(|one| &one.mine), asked(|one| &one.theirs));
        nothing_is_dropped(&base.walls, &mine.walls, &both.site.walls, &of_mine);
        nothing_is_dropped(&base.zones, &mine.zones, &both.site.zones, &of_mine);
        nothing_is_dropped(&base.walls, &theirs.walls, &both.site.walls, &of_theirs);
        nothing_is_dropped(&base.zones, &theirs.zones, &both.site.zones, &of_theirs);
        the_same_stays([&base.walls, &mine.walls, &theirs.walls], &both.site.walls);
        the_same_stays([&base.zones, &mine.zones, &theirs.zones], &both.site.zones);
        // The place of a conflict is that of what was kept there.
        for Conflict { kind, index, mine, theirs, .. } in &both.conflicts {
            let there = match kind {
                Kind::Wall => serde_json::to_value(&both.site.walls[*index]),
                _ => serde_json::to_value(&both.site.zones[*index]),
            };
            prop_assert_eq!(Some(&there.unwrap()), mine.as_ref().or(theirs.as_ref()));
        }
        // Whose edit it is makes no difference.
        let turned = merge(&base, &theirs, &mine);
        let mut asked: Vec<_> = both.conflicts.iter().map(|one| format!("{:?}{:?}", one.mine, one.theirs)).collect();
        let mut again: Vec<_> = turned.conflicts.iter().map(|one| format!("{:?}{:?}", one.theirs, one.mine)).collect();
        asked.sort();
        again.sort();
        prop_assert_eq!(asked, again);
        prop_assert_eq!(merge(&base, &mine, &base), Merged { site: mine.clone(), conflicts: vec![] });
        prop_assert_eq!(merge(&base, &base, &theirs), Merged { site: theirs.clone(), conflicts: vec![] });
        prop_assert_eq!(merge(&base, &mine, &mine), Merged { site: mine.clone(), conflicts: vec![] });
        prop_assert_eq!(changes(&base, &base), Vec::<String>::new());
    }
}
