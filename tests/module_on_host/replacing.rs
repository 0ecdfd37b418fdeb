//! A sensor that is taken away, and another one plugged in.

use crate::on_host::{Host, World};
use kehai::wire::{Event, EventKind, Message, Request};
use kehai_emulator::source::StillRoom;
use kehai_emulator::urg::model::{Interface, Model, UHG_08LX, URG_04LX, UTM_30LX};
use kehai_emulator::urg::{Config, Start, Urg};

/// Model, serial number and last step of its sensor.
async fn sensor(host: &Host) -> (String, String, u16) {
    let begin = host.mark();
    host.ask(Request::Info);
    host.expect(begin, "info", |_, message| match message {
        Message::Info(info) => {
            info.sensor.map(|sensor| (sensor.model.to_owned(), sensor.serial.to_owned(), sensor.last_step))
        }
        _ => None,
    })
    .await
}

#[test]
fn another_model_is_known_by_its_own_name_and_number_and_its_room_is_learned_anew() {
    let on_a_serial_line = |model: Model| Model { interface: Interface::Rs232, ..model };
    let (urg, utm) = (on_a_serial_line(URG_04LX), on_a_serial_line(UTM_30LX));
    let unnamed = Model { serial: "", ..on_a_serial_line(UHG_08LX) };
    for (before, after, gap_s) in [(urg, utm, 0.3), (utm, urg, 20.0), (urg, unnamed, 5.0)] {
        let world = World::new(Config::new(before));
        world.run(async || {
            let host = world.host(1);
            host.subscribe().await.unwrap();
            host.learned().await;
            world.link.unplug();
            host.stay(gap_s).await;
            let start = if after.powers_up_in_scip11 { Start::Scip11 } else { Start::Idle };
            let config = Config { start, ..Config::new(after) };
            let room = Box::new(StillRoom::new(after.geometry));
            world.link.with_sensor(|sensor, now_us| *sensor = Urg::new(config, room, now_us));
            world.link.replug();
            let begin = host.mark();
            host.expect(begin, "background", |_, message| match message {
                Message::Health(health) => {
                    let is_new =
                        |event: Event| event.kind == EventKind::Learned && event.background_version > 1;
                    health.events.iter().any(is_new).then_some(())
                }
                _ => None,
            })
            .await;
            let name = after.model_text.split('(').next().unwrap();
            let expected = (name.to_owned(), after.serial.to_owned(), after.geometry.last_step);
            assert_eq!(sensor(&host).await, expected);
        });
    }
}
