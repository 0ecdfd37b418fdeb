//! Which parts of a site are which after an edit: by name, by shape, or both.
//!
//! ```text
//!   before   zone hall ▭   zone study ▭   wall ╱  wall ╲
//!   after    zone hall ▱   zone lounge ▭  wall ╱  wall ─      and a new one, which matches none
//!              its name      its shape     equal   an end
//! ```

use super::part::Part;

/// For each part before, which of those after it is; none, if it was taken away. No two are the same one.
#[must_use]
pub fn pairs<P: Part>(before: &[P], after: &[P]) -> Vec<Option<usize>> {
    let mut found: Vec<Option<usize>> = vec![None; before.len()];
    let mut taken = vec![false; after.len()];
    // Where neither has moved in the list first: equal walls stay in their order.
    for (index, (was, is)) in before.iter().zip(after).enumerate() {
        if was == is {
            (found[index], taken[index]) = (Some(index), true);
        }
    }
    let same: [fn(&P, &P) -> bool; 3] = [
        |was, is| was == is,
        |was, is| !was.name().is_empty() && was.name() == is.name(),
        |was, is| !was.name().is_empty() && was.named(is.name()) == *is,
    ];
    for same in same {
        for (was, found) in before.iter().zip(&mut found).filter(|(_, found)| found.is_none()) {
            let mut free = after.iter().zip(&mut taken).enumerate();
            if let Some((index, (_, taken))) = free.find(|(_, (is, taken))| !**taken && same(was, is)) {
                (*found, *taken) = (Some(index), true);
            }
        }
    }
    by_shape(before, after, &mut found, &mut taken);
    found
}

/// What is left is the same if it has kept at least half of its corners; the most alike first.
fn by_shape<P: Part>(before: &[P], after: &[P], found: &mut [Option<usize>], taken: &mut [bool]) {
    let mut alike = Vec::new();
    let lost = before.iter().enumerate().filter(|(index, _)| found.get(*index) == Some(&None));
    for (was, part) in lost {
        let corners = part.corners();
        for (is, other) in after.iter().enumerate().filter(|(index, _)| taken.get(*index) == Some(&false)) {
            let others = other.corners();
            let kept = corners.iter().filter(|corner| others.contains(corner)).count();
            if kept > 0 && 2 * kept >= corners.len().min(others.len()) {
                alike.push((kept, was, is));
            }
        }
    }
    alike.sort_by_key(|&(kept, was, is)| (std::cmp::Reverse(kept), was, is));
    for (_, was, is) in alike {
        if let (Some(found @ None), Some(taken @ false)) = (found.get_mut(was), taken.get_mut(is)) {
            (*found, *taken) = (Some(is), true);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::site::Site;

    fn site(text: &str) -> Site {
        toml::from_str(text).unwrap()
    }

    fn zone(name: &str, x: f64) -> String {
        format!("[[zone]]\nname = \"{name}\"\npolygon = [[{x:?}, 0], [4, 0], [4, 4]]\n")
    }

    #[test]
    fn a_part_is_known_by_its_name_or_by_its_shape_wherever_it_stands() {
        let before = site(&[zone("a", 0.0), zone("b", 1.0), zone("c", 2.0), zone("d", 3.0)].concat());
        let after = site(&[zone("new", 9.0), zone("c", 2.5), zone("beta", 1.0), zone("a", 0.0)].concat());
        // What was d shares two corners with the new one, and so may be it.
        assert_eq!(pairs(&before.zones, &after.zones), [Some(3), Some(2), Some(1), Some(0)]);
        let far = site("[[zone]]\nname = \"far\"\npolygon = [[9, 9], [10, 9], [10, 10]]\n");
        assert_eq!(pairs(&before.zones, &far.zones), [None; 4]);
    }

    #[test]
    fn a_wall_is_known_by_its_ends() {
        let before = site(
            "[[wall]]\npoints = [[0, 0], [1, 0]]\n[[wall]]\npoints = [[0, 0], [1, 0]]\n[[wall]]\npoints = [[5, 5], [6, 5]]\n",
        );
        let after = site("[[wall]]\npoints = [[0, 0], [1, 0]]\n[[wall]]\npoints = [[5, 5], [6, 7]]\n");
        assert_eq!(pairs(&before.walls, &after.walls), [Some(0), None, Some(1)]);
        assert_eq!(
            (before.walls[1].label(1), before.walls[0].named("x")),
            ("wall 2".into(), before.walls[0].clone())
        );
    }
}
