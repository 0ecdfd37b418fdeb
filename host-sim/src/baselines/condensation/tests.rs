//! The equations of the paper, one after the other.

use super::*;

const AREA: Area = Area { middle: Point::new(0.0, 0.0), sides: Point::new(3.0, 3.0) };
const LEFT: Point = Point::new(-0.8, 0.2);
const RIGHT: Point = Point::new(0.8, -0.1);

fn settled() -> Condensation {
    let mut filter = Condensation::new(0.0, AREA, Settings::PAPER, 1);
    for reading in 1..20 {
        filter.places(f64::from(reading) / 9.0, &[LEFT, RIGHT]);
    }
    filter
}

fn near(filter: &Condensation, at: Point) -> usize {
    filter.particles.iter().filter(|particle| (particle.at - at).length() < 0.5).count()
}

#[test]
fn eq_1_is_the_mean_of_places_by_both_likelihoods() {
    let particle = |x: f64, place: f64, id: f64| Particle {
        at: Point::new(x, 0.0),
        velocity: Point::default(),
        place,
        ids: vec![id],
    };
    let mut filter = settled();
    filter.ids = vec![7];
    filter.particles = vec![particle(0.0, 0.5, 0.2), particle(1.0, 0.5, 0.6), particle(4.0, 0.0, 9.0)];
    let place = filter.place_of(7).unwrap();
    assert!((place - Point::new(0.75, 0.0)).length() < 1e-12, "{place:?}");
    assert_eq!(filter.place_of(8), None);
}

#[test]
fn eq_2_moves_a_particle_by_its_velocity_and_noise() {
    let settings = Settings { wander: 0.0, ..Settings::PAPER };
    let mut filter = Condensation::new(0.0, AREA, settings, 1);
    filter.particles.iter_mut().for_each(|particle| {
        (particle.at, particle.velocity) = (Point::default(), Point::new(1.0, -2.0));
    });
    filter.places(0.5, &[]);
    assert!(filter.particles.iter().all(|particle| particle.at == Point::new(0.5, -1.0)));
    let mut filter = Condensation::new(0.0, AREA, Settings { wander: 0.3, ..settings }, 1);
    filter.particles.iter_mut().for_each(|particle| particle.at = Point::default());
    filter.places(0.25, &[]);
    let square: f64 = filter.particles.iter().map(|particle| particle.at.x * particle.at.x).sum();
    let deviation_m = (square / filter.particles.len() as f64).sqrt();
    assert!((deviation_m - 0.15).abs() < 0.01, "w grows with the root of time: {deviation_m}");
}

#[test]
fn eq_3_weighs_by_the_normal_density_and_particles_gather_where_a_person_is() {
    let density = normal(Point::new(0.16, 0.0), 0.16);
    assert!((density - libm::exp(-0.5) / (std::f64::consts::TAU * 0.0256)).abs() < 1e-12, "{density}");
    let filter = settled();
    let (left, right) = (near(&filter, LEFT), near(&filter, RIGHT));
    assert!(left + right > 950 && left > 250 && right > 250, "{left} {right}");
}

#[test]
fn eq_4_lets_an_id_that_is_not_read_fade_and_leaves_the_others() {
    let mut filter = settled();
    filter.id(1, LEFT);
    let before = filter.particles[0].ids[0];
    filter.id(2, RIGHT);
    assert_eq!(filter.particles[0].ids[0], before, "a reading changes its own ID only");
    let highest = |filter: &Condensation| filter.particles.iter().map(|one| one.ids[0]).fold(0.0, f64::max);
    let full = highest(&filter);
    for reading in 1..=3 {
        filter.places(2.2 + f64::from(reading) / 9.0, &[LEFT, RIGHT]);
    }
    let faded = highest(&filter) / full;
    assert!((faded - libm::pow(0.5, 3.0)).abs() < 0.02, "half at each reading: {faded}");
    for reading in 1..=200 {
        filter.places(4.0 + f64::from(reading) / 9.0, &[LEFT, RIGHT]);
    }
    let place = filter.place_of(1).unwrap();
    assert!((place - LEFT).length() > 0.3, "in the end all particles are alike: {place:?}");
}

#[test]
fn an_id_moves_no_particle_and_finds_its_person() {
    let mut filter = settled();
    let before: Vec<Point> = filter.particles.iter().map(|particle| particle.at).collect();
    filter.id(1, LEFT + Point::new(0.05, 0.0));
    filter.id(2, RIGHT);
    let after: Vec<Point> = filter.particles.iter().map(|particle| particle.at).collect();
    assert_eq!(before, after);
    for (id, place) in [(1, LEFT), (2, RIGHT)] {
        let found = filter.place_of(id).unwrap();
        assert!((found - place).length() < 0.15, "{id}: {found:?}");
    }
}

#[test]
fn the_joint_filter_follows_its_readings_even_where_no_person_stands() {
    let mut joint = Joint::new(AREA, Settings::PAPER, 1);
    assert_eq!(joint.place_of(1), None);
    for reading in 1..20 {
        joint.id(1, f64::from(reading) / 9.0, LEFT);
        joint.places(f64::from(reading) / 9.0, &[LEFT, RIGHT]);
    }
    let found = joint.place_of(1).unwrap();
    assert!((found - LEFT).length() < 0.15, "{found:?}");
    // A wrong reading draws its particles away from where anybody stands. The separated filter's stay: the next right
    // reading finds them there.
    let mut separate = settled();
    let nowhere = Point::new(-0.8, 1.0);
    separate.id(1, nowhere);
    assert!(near(&separate, LEFT) + near(&separate, RIGHT) > 950);
    separate.id(1, LEFT);
    (0..5).for_each(|_| joint.id(1, 2.2, nowhere));
    joint.id(1, 2.2, LEFT);
    let (joint, separate) = (joint.place_of(1).unwrap(), separate.place_of(1).unwrap());
    assert!((separate - LEFT).length() < 0.15, "{separate:?}");
    assert!((joint - LEFT).length() > (separate - LEFT).length() + 0.1, "{joint:?} {separate:?}");
}
