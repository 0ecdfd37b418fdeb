//! Contents of a module's flash.

use crate::on_host::{Host, World};
use kehai::wire::{Message, Refusal, Request, SensorCode, SettingFault};
use kehai_emulator::urg::Config;
use kehai_emulator::urg::model::{Model, URG_04LX};

#[test]
fn settings_are_validated_stored_with_the_stream_stopped_and_there_after_a_restart() {
    let world = World::urg();
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        host.learned().await;
        let fault = |line, fault| Err(Refusal::Setting { line, fault });
        let set = async |text| host.order(Request::SetSettings { text }).await;
        assert_eq!(set("skip=1\nspeed=9").await, fault(1, SettingFault::Key));
        assert_eq!(set("foreground_mm=19").await, fault(0, SettingFault::Range));
        assert_eq!(set("first_step=500\nlast_step=100").await, fault(1, SettingFault::Conflict));
        assert!(host.settings().await.contains("skip=0\n"), "nothing of it was taken");
        let begin = host.mark();
        let operations = world.flash.operations();
        assert_eq!(set("name=hall\nskip=1\nforeground_mm=210").await, Ok(()));
        assert!(world.flash.operations() > operations);
        host.stay(5.0).await;
        let told = host.all(begin, |_, message| match message {
            Message::Health(health) => {
                Some((health.head.storing, health.head.sensor.code, health.head.setup))
            }
            _ => None,
        });
        assert!(told[0].0, "storing is announced before anything else: {told:?}");
        assert!(
            told.iter().any(|(storing, sensor, _)| *storing && *sensor == SensorCode::Paused),
            "{told:?}"
        );
        let (storing, sensor, setup) = *told.last().unwrap();
        assert_eq!((storing, sensor, setup), (false, SensorCode::Streaming, 2));
        let begin = host.mark();
        host.stay(4.0).await;
        assert!((19..=21).contains(&host.sequences(begin).len()), "every second scan is skipped");
        host.order(Request::Restart).await.unwrap();
        host.be_silent(1.0).await;
        host.subscribe().await.unwrap();
        assert!(host.settings().await.starts_with("name=hall\nforeground_mm=210\n"));
        let begin = host.mark();
        host.stay(8.0).await;
        let versions = host.all(begin, |_, message| match message {
            Message::Report(report) => Some(report.head.background_version),
            _ => None,
        });
        assert!(
            versions.len() > 20 && versions.iter().all(|version| *version == 1),
            "the background is back"
        );
    });
}

/// The serial number that the module has of its sensor.
async fn serial(host: &Host) -> String {
    let begin = host.mark();
    host.ask(Request::Info);
    host.stay(0.5).await;
    let serials = host.all(begin, |_, message| match message {
        Message::Info(info) => info.sensor.map(|sensor| sensor.serial.to_owned()),
        _ => None,
    });
    serials.last().unwrap().clone()
}

#[test]
fn a_serial_number_that_becomes_known_after_a_restart_keeps_the_background() {
    let unnamed = World::new(Config::new(Model { serial: "", ..URG_04LX }));
    unnamed.run(async || {
        let host = unnamed.host(1);
        host.subscribe().await.unwrap();
        host.learned().await;
        host.stay(5.0).await;
        assert_eq!(serial(&host).await, "");
    });
    let named = World { flash: unnamed.flash.clone(), ..World::urg() };
    named.run(async || {
        let host = named.host(1);
        host.subscribe().await.unwrap();
        host.stay(4.0).await;
        let begin = host.mark();
        host.stay(4.0).await;
        assert_ne!(serial(&host).await, "");
        let versions = host.all(begin, |_, message| match message {
            Message::Report(report) => Some(report.head.background_version),
            _ => None,
        });
        assert!(versions.len() > 20 && versions.iter().all(|version| *version == 1), "{versions:?}");
    });
}

#[test]
fn the_stream_is_stopped_while_flash_is_written() {
    let world = World::urg();
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        let mut last = world.flash.operations();
        for _ in 0..2000 {
            world.wait(0.01).await;
            let operations = world.flash.operations();
            if operations != last {
                let state = world.link.with_sensor(|sensor, _| sensor.state());
                assert_ne!(state, kehai_emulator::urg::State::Streaming, "{operations} operations");
            }
            last = operations;
        }
        host.stay(0.1).await;
        assert!(world.flash.operations() > 10, "the background was stored");
    });
}

#[test]
fn settings_survive_a_power_cut_at_any_write() {
    let mut outcomes = [0, 0];
    for cut in 0.. {
        let world = World::urg();
        let prepare = async || {
            let host = world.host(1);
            host.subscribe().await.unwrap();
            host.order(Request::SetSettings { text: "name=old" }).await.unwrap();
            world.flash.cut_after(cut);
            let begin = host.mark();
            let id = host.ask(Request::SetSettings { text: "name=new" });
            host.answer(begin, id).await
        };
        let answer = world.run(prepare);
        let off = world.flash.power_on();
        assert!(answer == Ok(()) || off && answer == Err(Refusal::NotStored), "{answer:?}, cut {cut}");
        // Another board with the same flash: power-up.
        let name = world.run(async || {
            let host = world.host(2);
            host.subscribe().await.unwrap();
            host.settings().await.lines().next().unwrap().to_owned()
        });
        let new = name == "name=new";
        assert!(new || answer.is_err() && name == "name=old", "{name} after cut {cut} and {answer:?}");
        outcomes[usize::from(new)] += 1;
        if !off {
            break;
        }
    }
    assert!(outcomes[0] >= 2 && outcomes[1] >= 1, "{outcomes:?}");
}
