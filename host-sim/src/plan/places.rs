//! The places at which modules can be mounted, with their height: [`mounts`].

use kehai_tracking::mounts::mounts;

use super::{Mount, Task};

/// Most places; a larger site has them farther apart.
const MOST: f64 = 4000.0;

/// All places, in the order of the walls.
#[must_use]
pub fn places(task: &Task) -> Vec<Mount> {
    let mount = |pose| Mount { pose, height_m: task.height_m };
    mounts(&task.site, MOST).into_iter().map(mount).collect()
}

#[cfg(test)]
mod tests {
    use super::super::ORDINARY_CLOTHES;
    use super::*;
    use crate::world::geometry::Point;
    use crate::world::optics::SensorModel;
    use crate::world::site::Site;

    fn task(text: &str) -> Task {
        Task {
            site: Site::parse("plan.toml", text).unwrap(),
            model: SensorModel::Urg04lx,
            height_m: 0.6,
            clothes: ORDINARY_CLOTHES,
            people: 1,
            seed: 0,
        }
    }

    #[test]
    fn a_room_has_places_on_all_walls_and_in_all_corners_facing_in_and_out() {
        let found = places(&task("[[wall]]\npoints = [[0, 0], [2, 0], [2, 1], [0, 1], [0, 0]]"));
        // Seven places between the ends of 2 m and three of 1 m, on both sides; four corners from in and out.
        assert_eq!(found.len(), 2 * 2 * (7 + 3) + 2 * 4);
        let within: Vec<&Mount> = found
            .iter()
            .filter(|place| (0.0..2.0).contains(&place.pose.at.x) && (0.0..1.0).contains(&place.pose.at.y))
            .collect();
        assert_eq!(within.len(), found.len() / 2);
        let middle = Point::new(1.0, 0.5);
        for place in within {
            let ahead = place.pose.to_sensor(middle);
            assert!(ahead.x > 0.0, "{place:?} looks at the wall");
        }
        let corner =
            found.iter().find(|place| (place.pose.at - Point::new(0.05, 0.05)).length() < 1e-9).unwrap();
        assert!((corner.pose.yaw_rad - std::f64::consts::FRAC_PI_4).abs() < 1e-9);
    }

    #[test]
    fn nothing_is_mounted_within_a_wall_that_ends_on_another() {
        let walls = "[[wall]]\npoints = [[0, 0], [2, 0]]\n[[wall]]\npoints = [[1, 0], [1, 1]]\n";
        let found = places(&task(walls));
        assert!(found.iter().any(|place| (place.pose.at - Point::new(1.25, 0.05)).length() < 1e-9));
        assert!(found.iter().all(|place| place.pose.at.y < 0.0 || (place.pose.at.x - 1.0).abs() > 0.04));
    }

    #[test]
    fn glass_entries_and_movers_carry_no_module() {
        let walls = "[[wall]]\npoints = [[0, 0], [2, 0]]\nblocks = [\"people\"]\n[[wall]]\npoints = [[0, 1], [1, 1], [2, 1]]\n";
        let all = places(&task(walls));
        assert!(!all.is_empty() && all.iter().all(|place| place.pose.at.y > 0.5));
        let entry = "[[zone]]\nname = \"a\"\npolygon = [[0, 0], [2, 0], [2, 1]]\n[[entry]]\nname = \"in\"\nline = [[1, 1], [2, 1]]\nzone = \"a\"\n";
        assert!(places(&task(&format!("{walls}{entry}"))).iter().all(|place| place.pose.at.x < 0.9));
        let mover = "[[mover]]\npolygon = [[0, 0.5], [2, 0.5], [2, 1], [0, 1]]\n";
        assert!(places(&task(&format!("{walls}{mover}"))).iter().all(|place| place.pose.at.y > 1.0));
    }
}
