//! What a demo adds up to: how many people were counted and where, beside the truth.

use host_tracker::store::card::CardKey;
use kehai_tracking::card::Card;
use kehai_tracking::door::doors::Output;
use kehai_tracking::door::passage::Passage;
use kehai_tracking::geometry::{Point, inside};
use kehai_tracking::jsonl::TrackLine;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{DeviceState, Snapshot};
use kehai_tracking::tracker::LifeCycle;

use super::stage::Person;

/// Distance up to which a track stands for a person, m: as far as the papers' scores allow.
const MATCH_M: f64 = 0.5;

/// Sums over the frames of a run.
#[derive(Default)]
pub struct Summary {
    key: Option<CardKey>,
    frames: u32,
    /// Since when every module watches, s of the tracker.
    ready_s: Option<f64>,
    /// Frames since then, and those with the right number of people.
    judged: u32,
    right: u32,
    people: u32,
    found: u32,
    errors_m: Vec<f64>,
    /// People found whose tag has been read, and those of them whose own track carries it with a probability above 0.5.
    read: u32,
    named: u32,
    most: usize,
    /// Passages through guarded doors, as the door judged them.
    passages: Vec<Passage>,
    newest: Snapshot,
}

impl Summary {
    /// Nothing yet; `key` is the key of the site's tags.
    pub fn new(key: Option<CardKey>) -> Self {
        Self { key, ..Self::default() }
    }

    /// Takes a frame, and the people at its time.
    pub fn add(&mut self, frame: &Snapshot, people: &[Person], site: &Site) {
        self.frames += 1;
        self.newest = frame.clone();
        let watching = !frame.modules.is_empty()
            && frame.modules.iter().all(|module| module.state == DeviceState::Watching);
        if self.ready_s.is_none() && watching {
            self.ready_s = Some(frame.line.t);
        }
        if self.ready_s.is_none() {
            return;
        }
        let zones: Vec<Vec<Point>> =
            site.zones.iter().map(|zone| zone.polygon.iter().map(|&at| at.into()).collect()).collect();
        let is_inside = |at: Point| zones.iter().any(|zone| inside(at, zone));
        let there: Vec<&Person> = people.iter().filter(|person| is_inside(person.at)).collect();
        let counts = |track: &&TrackLine| {
            track.state != LifeCycle::Tentative && is_inside(Point::new(track.x, track.y))
        };
        let tracks: Vec<&TrackLine> = frame.line.tracks.iter().filter(counts).collect();
        self.judged += 1;
        self.right += u32::from(tracks.len() == there.len());
        self.most = self.most.max(there.len());
        for person in &there {
            let distance_m = |track: &TrackLine| (Point::new(track.x, track.y) - person.at).length();
            let nearest = tracks.iter().min_by(|one, other| distance_m(one).total_cmp(&distance_m(other)));
            self.people += 1;
            let Some(track) = nearest.filter(|track| distance_m(track) < MATCH_M) else { continue };
            self.found += 1;
            self.errors_m.push(distance_m(track));
            let card = person.tag.as_ref().zip(self.key.as_ref()).map(|(tag, key)| Card::from(key.hash(tag)));
            let Some(name) = frame.names.iter().find(|name| card.is_some() && name.card == card) else {
                continue;
            };
            self.read += 1;
            let is_its = |likely: &kehai_tracking::names::Likelihood| {
                likely.track == track.id && likely.probability > 0.5
            };
            self.named += u32::from(name.tracks.first().is_some_and(is_its));
        }
    }

    /// Takes what a guarded door puts out.
    pub fn door(&mut self, output: &Output) {
        match output {
            Output::Passage(passed) => self.passages.push(passed.passage.clone()),
            Output::NotTaken { door, why } => println!("{door}: {why}"),
            Output::Lock { .. } | Output::Alarm { .. } => {}
        }
    }

    /// Prints it.
    pub fn print(mut self, scene: &str, signs: Option<(u64, u64)>) {
        let share = |part: u32, whole: u32| match whole {
            0 => "-".to_owned(),
            _ => format!("{:.1} %", 100.0 * f64::from(part) / f64::from(whole)),
        };
        self.errors_m.sort_by(f64::total_cmp);
        let median = self.errors_m.get(self.errors_m.len() / 2);
        println!("the scene {scene}, {:.0} s", self.newest.line.t);
        match self.ready_s {
            Some(ready_s) => println!("  all modules watch     after {ready_s:.1} s"),
            None => println!("  all modules watch     not yet: learning takes about ten seconds"),
        }
        println!("  frames                {}, {} of them judged", self.frames, self.judged);
        println!("  people                {} at most at once", self.most);
        println!("  counted right         {} of the judged frames", share(self.right, self.judged));
        println!("  found where they are  {} of the time", share(self.found, self.people));
        println!(
            "  off by                {} (median)",
            median.map_or_else(|| "-".to_owned(), |metres| format!("{:.0} mm", metres * 1e3))
        );
        if let Some((taken, refused)) = signs {
            println!("  tags read             {taken} times, {refused} refused");
            println!("  named right           {} of the time a tag was known", share(self.named, self.read));
        }
        for Passage { door, entered, tries, through, reason, .. } in &self.passages {
            let through = through.len();
            println!("  {door:<20}  {entered} entered, {tries} tries, {through} through: {reason}");
        }
        println!("  {:<20} {:>9} {:>7} {:>9}  state", "device", "scans/s", "lost", "unknown");
        for module in &self.newest.modules {
            let percent = |share: f64| format!("{:.1} %", share * 100.0);
            let lost = module.lost_share.map_or_else(|| "–".to_owned(), percent);
            println!(
                "  {:<20} {:>9.1} {lost:>7} {:>7.1} %  {}",
                module.name,
                module.scans_hz,
                module.unknown_share * 100.0,
                module.state
            );
        }
        println!("  {:<20} {:>9}  known", "zone", "people");
        for (name, zone) in &self.newest.line.zones {
            let count = zone.count().map_or_else(|| "–".to_owned(), |count| count.to_string());
            println!("  {name:<20} {count:>9}  {}", format!("{:?}", zone.state()).to_lowercase());
        }
    }
}
