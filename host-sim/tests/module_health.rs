//! A module's alarms through the whole chain: sensors, modules and a disturbed network, with people about.
#![allow(missing_docs, reason = "a test program")]

use std::collections::BTreeMap;
use std::sync::Arc;

use host_sim::experiment::plan::Case;
use host_sim::run::{Conditions, Options, Outage, Record};
use host_sim::world::variation::Letter;
use host_tracker::follower::Follower;
use host_tracker::health::Watch;
use host_tracker::trackers::Choice;
use kehai::wire::{Message, ModuleId};

/// All alarms there were, by module, each with its text when it was raised; and the last lines' figures.
fn alarms(options: &Options) -> (BTreeMap<ModuleId, Vec<(f64, String)>>, Vec<(f64, f64, f64)>) {
    let case = Case::door(Letter::H, 5, &[]);
    let record = Record::of(&case.build().unwrap(), 3, options).unwrap();
    let mut follower = Follower::new(&Arc::new(record.site.clone()), Choice::default());
    let mut watches: BTreeMap<ModuleId, Watch> = BTreeMap::new();
    let mut raised: BTreeMap<ModuleId, Vec<(f64, String)>> = BTreeMap::new();
    let mut figures = BTreeMap::new();
    let mut arrivals = record.arrivals.iter().peekable();
    for moment in &record.truth {
        while let Some(arrival) = arrivals.next_if(|arrival| arrival.at_us as f64 * 1e-6 <= moment.t) {
            let Ok((header, _)) = Message::decode(&arrival.bytes) else { continue };
            let watch = watches.entry(header.identity.module).or_insert_with(|| Watch::new(arrival.at_us));
            follower.receive(&arrival.bytes, arrival.at_us);
            watch.receive(&arrival.bytes, arrival.at_us);
        }
        for (id, watch) in &mut watches {
            let clock = follower.intake().modules().get(id).map(|module| module.clock());
            let line = watch.line("", *id, clock, (moment.t * 1e6) as u64);
            figures.insert(*id, (line.scans_hz, line.lost_share, line.clock_jitter_ms));
            let known = raised.entry(*id).or_default();
            for alarm in line.alarms {
                if !known.iter().any(|(_, name)| *name == alarm.name) {
                    known.push((moment.t, alarm.name));
                }
            }
        }
    }
    (raised, figures.into_values().collect())
}

#[test]
fn people_and_a_disturbed_network_raise_no_alarm() {
    let (raised, figures) = alarms(&Options { conditions: Conditions::DISTURBED, ..Options::default() });
    println!("scans/s, lost share, jitter ms: {figures:.3?}");
    assert!(raised.len() > 1 && raised.values().all(Vec::is_empty), "{raised:?}");
}

#[test]
fn a_module_that_falls_silent_is_told_and_the_others_are_not() {
    let outages = vec![Outage { module: 0, from_s: 20.0, until_s: Some(30.0) }];
    let (raised, _) = alarms(&Options { outages, ..Options::default() });
    let told: Vec<&(f64, String)> = raised.values().flatten().collect();
    assert!(
        matches!(told[..], [(at_s, name)] if name == "silent" && (22.9..24.5).contains(at_s)),
        "{raised:?}"
    );
}
