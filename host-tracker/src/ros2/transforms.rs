//! Where the modules are, as `tf2_msgs/msg/TFMessage`.
//!
//! ```text
//!   map ─▶ kehai/PART     x where the front step points, y to the left, z up: at the height of the plane of its beams
//! ```

use std::collections::BTreeMap;

use kehai_tracking::site::Site;

use super::messages::{Header, Quaternion, TfMessage, Transform, TransformStamped, Vector3};
use super::names::{MAP, module_frame};

/// Those of all modules that are placed, from `at_ns` on, since 1970. `parts` has their parts of names.
pub fn transforms(site: &Site, parts: &BTreeMap<String, String>, at_ns: u64) -> TfMessage {
    let placed = site.modules.iter().filter(|module| module.placed);
    let transforms = placed.filter_map(|module| {
        let child_frame_id = module_frame(parts.get(&module.name)?);
        let translation = Vector3 { x: module.x, y: module.y, z: module.height_m };
        let transform = Transform { translation, rotation: Quaternion::yaw(module.pose().yaw_rad) };
        Some(TransformStamped { header: Header::new(MAP, at_ns), child_frame_id, transform })
    });
    TfMessage { transforms: transforms.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros2::names::parts;

    #[test]
    fn each_module_that_is_placed_has_a_frame() {
        let site = "
            [[module]]
            name = \"left-1\"
            x = 1
            y = 2
            yaw_deg = 90
            height_m = 1.1
            [[module]]
            name = \"box\"
            x = 0
            y = 0
            placed = false";
        let site: Site = toml::from_str(site).unwrap();
        let parts = parts(site.modules.iter().map(|module| module.name.as_str()));
        let said = transforms(&site, &parts, 5_000_000_007);
        let [left] = &said.transforms[..] else { unreachable!("{said:?}") };
        assert_eq!((left.header.frame_id.as_str(), left.child_frame_id.as_str()), ("map", "kehai/left_1"));
        assert_eq!(left.transform.translation, Vector3 { x: 1.0, y: 2.0, z: 1.1 });
        assert_eq!(left.transform.rotation, Quaternion::yaw(std::f64::consts::FRAC_PI_2));
        assert_eq!((left.header.stamp.sec, left.header.stamp.nanosec), (5, 7));
    }
}
