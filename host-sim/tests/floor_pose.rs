//! A floor's place from a guided walk, in a home and in a flat whose modules are put elsewhere by each seed: how right it is,
//! and that a walk is refused that missed the floor or left it early, and the floor named.

use host_sim::experiment::poses::{self, Off};

/// A tenth of those that are published.
const SEEDS: std::ops::Range<u64> = 1000..1008;

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn a_walk_places_a_floor_and_one_that_misses_it_is_refused() {
    for scene in ["home", "flat"] {
        let mut found: Vec<Off> = Vec::new();
        for seed in SEEDS {
            let came = poses::floor(scene, seed).unwrap();
            println!("{scene} {seed}: {came:?}");
            assert!(came.short, "{scene}, seed {seed}");
            found.extend(came.by_both.into_iter().flatten());
        }
        assert!(found.len() + 1 >= SEEDS.count(), "{scene}: {} placed", found.len());
        let degrees = |off: &Off| off.radians.to_degrees();
        assert!(median(found.iter().map(|off| off.metres).collect()) < 0.04, "{scene}: {found:?}");
        assert!(median(found.iter().map(degrees).collect()) < 1.0, "{scene}: {found:?}");
        let holds = |off: &&Off| off.metres <= 1.5 * off.bound_m && off.radians <= 1.5 * off.bound_rad;
        assert_eq!(found.iter().filter(holds).count(), found.len(), "{scene}: {found:?}");
    }
}
