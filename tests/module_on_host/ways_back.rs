//! Settings that do not work do not stay: the ways back.

use crate::on_host::{Host, World};
use kehai::device::Addressing;
use kehai::device::starts::ShortStarts;
use kehai::device::trial::TRIAL_US;
use kehai::wire::{EventKind, Message, Refusal, Request, SettingFault};

const NEW: &str = "10.0.1.7/24,10.0.1.1";

fn new() -> Addressing {
    Addressing::from_text(NEW.as_bytes()).unwrap()
}

/// Sets the new addressing, and waits until the module has started over it.
async fn set_new(world: &World) {
    let host = world.host(1);
    host.subscribe().await.unwrap();
    let starts = world.starts.get();
    host.order(Request::SetSettings { text: &format!("address={NEW}") }).await.unwrap();
    host.order(Request::Restart).await.unwrap();
    host.be_silent(1.0).await;
    assert_eq!((world.starts.get(), world.addressing.get()), (starts + 1, new()));
}

async fn address(host: &Host) -> String {
    let settings = host.settings().await;
    settings.lines().find_map(|line| line.strip_prefix("address=")).unwrap().to_owned()
}

async fn has_said(host: &Host, kind: EventKind) -> bool {
    let begin = host.mark();
    host.expect(begin, "health", |_, message| match message {
        Message::Health(health) => Some(health.events.iter().any(|event| event.kind == kind)),
        _ => None,
    })
    .await
}

#[test]
fn f2_an_address_that_bricks_is_refused_and_nothing_is_stored() {
    let world = World::urg();
    world.run(async || {
        let host = world.host(1);
        host.subscribe().await.unwrap();
        for (value, fault) in [
            ("224.0.0.1/24", SettingFault::Range),
            ("255.255.255.255/30", SettingFault::Range),
            ("0.0.0.0/8", SettingFault::Range),
            ("127.0.0.1/8", SettingFault::Range),
            ("10.0.0.7/32", SettingFault::Range),
            ("10.0.0.7/24,10.0.0.7", SettingFault::Conflict),
        ] {
            let operations = world.flash.operations();
            let text = format!("address={value}");
            let answer = host.order(Request::SetSettings { text: &text }).await;
            assert_eq!(answer, Err(Refusal::Setting { line: 0, fault }), "{value}");
            assert_eq!(world.flash.operations(), operations);
        }
        assert_eq!(address(&host).await, "dhcp");
    });
}

#[test]
fn a_host_that_is_answered_over_the_new_address_keeps_it() {
    let world = World::urg();
    world.run(async || {
        set_new(&world).await;
        world.wait(200.0).await;
        let host = world.host(2);
        host.subscribe().await.unwrap();
        host.stay(TRIAL_US as f64 / 1e6).await;
        assert_eq!((world.starts.get(), world.addressing.get()), (2, new()));
    });
    // Powered up again, alone: it is kept all the same.
    world.run(async || world.wait(TRIAL_US as f64 / 1e6 + 10.0).await);
    assert_eq!((world.starts.get(), world.addressing.get()), (3, new()));
}

#[test]
fn f2_the_old_address_comes_back_when_no_host_is_answered_within_five_minutes() {
    let world = World::urg();
    world.run(async || {
        set_new(&world).await;
        let stranger = world.host(3);
        stranger.ask(Request::Subscribe { t1: [1; 8] });
        world.wait(TRIAL_US as f64 / 1e6 - 10.0).await;
        assert_eq!((world.starts.get(), world.addressing.get()), (2, new()), "a cookie given proves nothing");
        world.wait(15.0).await;
        assert_eq!((world.starts.get(), world.addressing.get()), (3, Addressing::Dhcp));
        let host = world.host(1);
        host.subscribe().await.unwrap();
        assert_eq!(address(&host).await, "dhcp");
    });
}

#[test]
fn f2_a_trial_goes_on_after_a_loss_of_power_and_ends_with_the_fourth_start() {
    let world = World::urg();
    world.run(async || set_new(&world).await);
    // Each run is a power-up with the same flash; the first start over the new address has been counted.
    for _ in 2..=3 {
        world.run(async || world.wait(100.0).await);
        assert_eq!(world.addressing.get(), new());
    }
    world.run(async || {
        let host = world.host(2);
        host.subscribe().await.unwrap();
        assert_eq!(address(&host).await, "dhcp");
        assert!(has_said(&host, EventKind::AddressReturned).await);
        host.stay(30.0).await;
    });
    world.run(async || {
        let host = world.host(2);
        host.subscribe().await.unwrap();
        assert_eq!(address(&host).await, "dhcp", "it is stored, too");
        assert!(!has_said(&host, EventKind::AddressReturned).await);
    });
}

#[test]
fn new_addressing_is_never_stored_without_its_trial_wherever_the_power_is_cut() {
    let mut outcomes = [0, 0];
    for cut in 0.. {
        let world = World::urg();
        let answer = world.run(async || {
            let host = world.host(1);
            host.subscribe().await.unwrap();
            world.flash.cut_after(cut);
            host.order(Request::SetSettings { text: &format!("address={NEW}") }).await
        });
        let off = world.flash.power_on();
        world.run(async || world.wait(1.0).await);
        let changed = world.addressing.get() == new();
        assert!(changed || answer.is_err(), "cut {cut}");
        outcomes[usize::from(changed)] += 1;
        world.run(async || world.wait(TRIAL_US as f64 / 1e6 + 10.0).await);
        assert_eq!(world.addressing.get(), Addressing::Dhcp, "cut {cut}");
        if !off {
            break;
        }
    }
    assert!(outcomes[0] >= 2 && outcomes[1] >= 1, "{outcomes:?}");
}

#[test]
fn f2_after_three_starts_that_did_not_last_this_one_is_over_dhcp() {
    let world = World::urg();
    world.run(async || {
        set_new(&world).await;
        let host = world.host(2);
        host.subscribe().await.unwrap();
        host.stay(20.0).await;
    });
    world.short_starts.set(ShortStarts::new(2));
    world.run(async || world.wait(1.0).await);
    assert_eq!(world.addressing.get(), new());
    world.short_starts.set(ShortStarts::new(3));
    world.run(async || {
        let host = world.host(2);
        host.subscribe().await.unwrap();
        assert_eq!((world.addressing.get(), address(&host).await.as_str()), (Addressing::Dhcp, NEW));
        assert!(has_said(&host, EventKind::AddressDefault).await);
        host.order(Request::SetSettings { text: "name=hall" }).await.unwrap();
        assert_eq!(address(&host).await, NEW, "it is no part of that change");
    });
    world.short_starts.set(ShortStarts::default());
    world.run(async || world.wait(TRIAL_US as f64 / 1e6 + 10.0).await);
    assert_eq!(world.addressing.get(), new(), "tried again once a start has lasted, and not on trial");
}
