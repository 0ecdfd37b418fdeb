//! A program that links only if nothing it calls can panic.
//!
//! It is no firmware and never runs. It feeds opaque bytes to every sans-I/O part of the core; its
//! panic handler calls a function that does not exist. If the optimiser leaves a single reachable
//! panic, the linker reports `a_panic_is_reachable` as undefined, with the place that needs it.
//!
//! `./ci.sh no-panic` builds it for a Cortex-M4 with the release profile.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod proof {
    use core::panic::PanicInfo;

    unsafe extern "C" {
        fn a_panic_is_reachable() -> !;
    }

    #[panic_handler]
    fn panic(_: &PanicInfo<'_>) -> ! {
        // SAFETY: the function has no definition: this call is either removed or fails to link.
        unsafe { a_panic_is_reachable() }
    }

    /// A value the optimiser knows nothing about.
    fn opaque<T>(address: usize) -> T {
        // SAFETY: never executed; the address stands for memory the compiler cannot see into.
        unsafe { core::ptr::read_volatile(address as *const T) }
    }

    /// Keeps a result alive.
    fn keep<T>(address: usize, value: T) {
        // SAFETY: never executed, as above.
        unsafe { core::ptr::write_volatile(address as *mut T, value) }
    }

    /// Where the linker begins.
    #[unsafe(no_mangle)]
    pub extern "C" fn _start() -> ! {
        let at = 0x2000_0000;
        math(at);
        scip(at);
        sensor(at);
        perception(at);
        wire(at);
        floor(at);
        module(at);
        loop {}
    }

    fn math(at: usize) {
        use kehai::math;
        let (x, y): (f32, f32) = (opaque(at), opaque(at));
        keep(at, math::sin_cos(x));
        keep(at, [math::atan2(y, x), math::sqrt(x), math::hypot(x, y), math::round(x), math::floor(x)]);
        keep(at, math::wrap_angle(x));
    }

    fn perception(at: usize) {
        use kehai::background::{Absorb, BeamProfile, Fingerprint, LearnRequest};
        use kehai::centre::{Estimator, centre};
        use kehai::pipeline::{Pipeline, Settings};
        use kehai::scan::{Geometry, Scan};
        use kehai::visibility::seen_empty;
        const BEAMS: usize = 1081;
        // SAFETY: never executed, as above.
        let pipeline: &mut Pipeline<BEAMS> = unsafe { &mut *(at as *mut Pipeline<BEAMS>) };
        let Ok(geometry) = Geometry::new(opaque(at)) else { return };
        let ranges_mm: [u16; BEAMS] = opaque(at);
        let serial: [u8; 16] = opaque(at);
        let settings: Settings = opaque(at);
        keep(at, pipeline.configure(&geometry, settings, Fingerprint::of(&serial, &geometry)).is_ok());
        let ranges_mm = ranges_mm.get(..opaque(at)).unwrap_or(&ranges_mm);
        let scan = Scan { geometry: &geometry, ranges_mm, time: opaque(at) };
        let judgement = pipeline.process(&scan);
        let radius_mm = opaque(at);
        for candidate in judgement.candidates() {
            keep(at, centre(candidate, &geometry, Estimator::Silhouette));
            keep(at, centre(candidate, &geometry, Estimator::TwoPoint { radius_mm }));
        }
        let profile: [BeamProfile; BEAMS] = opaque(at);
        let mut empty_mm: [u16; BEAMS] = opaque(at);
        let (candidates, unseen) = (judgement.candidates(), judgement.unseen());
        seen_empty(&geometry, &profile, candidates, unseen, opaque(at), &mut empty_mm);
        keep(at, empty_mm);
        let (request, wish): (LearnRequest, Absorb) = (opaque(at), opaque(at));
        keep(at, (pipeline.learn(request).is_ok(), pipeline.absorb(wish).is_ok()));
        let background = pipeline.background();
        background.profile().chain(background.model()).for_each(|beam| keep(at, beam));
        keep(at, background.suspects().first().copied());
        keep(at, (background.version(), pipeline.counters(), pipeline.settings()));
    }

    fn scip(at: usize) {
        use kehai::scip::{Command, Event, Measurement, Reader, Width};
        use kehai::sensor_model::SensorModel;
        let mut reader: Reader = opaque(at);
        let mut ranges_mm: [u16; 64] = opaque(at);
        let (first_step, last_step, flag): (u16, u16, bool) = (opaque(at), opaque(at), opaque(at));
        let (cluster, skip, scans) = (opaque(at), opaque(at), opaque(at));
        let width = if flag { Width::Two } else { Width::Three };
        let measurement = Measurement { first_step, last_step, cluster, skip, scans, width };
        for command in
            [Command::Measure(measurement), Command::Get(measurement), Command::BitRate(opaque(at))]
        {
            if let Ok(request) = command.encode() {
                keep(at, [request.as_bytes().len(), request.echo().len()]);
                reader.expect(&request);
            }
        }
        let bytes: [u8; 64] = opaque(at);
        let fed = reader.feed(bytes.get(..opaque(at)).unwrap_or(&bytes), opaque(at), &mut ranges_mm);
        if let Some(Event::Parameters(parameters)) = &fed.event {
            keep(at, parameters.geometry(&measurement));
            let model = SensorModel::of(parameters.model.as_str());
            keep(at, (model.open_range_mm(opaque(at)), model.rates_baud.len(), model.blind_code));
        }
        keep(at, fed);
        reader.restart();
        reader.forget();
        keep(at, reader);
        keep(at, ranges_mm);
    }

    /// Sends to nowhere.
    struct Outbox;

    impl kehai::link::Outbox for Outbox {
        fn try_send_to(
            &mut self,
            lane: kehai::link::Lane,
            to: core::net::SocketAddrV4,
            datagram: &[u8],
        ) -> Result<(), kehai::link::Dropped> {
            let at = 0x2000_0000;
            keep(at, (lane, to, datagram.len()));
            opaque(at)
        }

        fn is_empty(&mut self, lane: kehai::link::Lane) -> bool {
            keep(0x2000_0000, lane);
            opaque(0x2000_0000)
        }

        fn reopen(&mut self, lane: kehai::link::Lane) {
            keep(0x2000_0000, lane);
        }
    }

    /// What flash says of images, and what is written for a job.
    fn image(at: usize, job: kehai::update::plan::ImageJob<'_>) {
        use kehai::update::plan::Known;
        use kehai::update::slots::Slots;
        let slots: Slots = opaque(at);
        let mut known = Known::NOTHING;
        keep(at, known.least(opaque(at), &opaque(at)));
        known.candidate(&opaque(at));
        known.state(&opaque::<[u8; 16]>(at));
        keep(at, known.standing(&slots));
        for sizes in [(4096, 1), (8192, 16)] {
            keep(at, known.plan(job, &slots, sizes).map(|plan| plan.iter().flatten().count()));
        }
    }

    fn module(at: usize) {
        use kehai::device::starts::ShortStarts;
        use kehai::device::tiles::Tiles;
        use kehai::device::trial::{StoredAddressing, Trial};
        use kehai::device::{Module, Settings};
        use kehai::seal::{Channel, Keyring};
        use kehai::wire::DATAGRAM_MAX;
        let mut module: Module<64> = opaque(at);
        let mut bytes: [u8; DATAGRAM_MAX + 1] = opaque(at);
        let datagram = bytes.get_mut(..opaque(at)).unwrap_or(&mut []);
        let from = core::net::SocketAddrV4::new(opaque::<u32>(at).into(), opaque(at));
        let restored = Settings::restored(datagram);
        let stored = StoredAddressing {
            addressing: restored.settings.addressing,
            unusable: restored.address_unusable,
            trial: Trial::from_bytes(datagram),
            short_starts: ShortStarts::new(opaque(at)),
        };
        module.begin(opaque(at), restored.settings);
        keep(at, module.begin_addressing(stored).map(|trial| trial.bytes()));
        let mut keyring = Keyring::restored(Ok(datagram));
        keyring.set_label(&opaque(at));
        module.begin_keys(keyring);
        if let Some(work) = module.receive(from, datagram, opaque(at), &mut Outbox) {
            image(at, work.job(datagram));
            module.image_done(&work, opaque(at), opaque(at), &mut Outbox);
        }
        module.begin_images(opaque(at));
        module.confirmed(opaque(at), opaque(at), &mut Outbox);
        module.told(opaque(at));
        let session: kehai::sensor::Session = opaque(at);
        module.sensor(&session, opaque(at), &mut Outbox);
        let (geometry, ranges_mm): (kehai::scan::Geometry, [u16; 64]) = (opaque(at), opaque(at));
        let ranges_mm = ranges_mm.get(..opaque(at)).unwrap_or(&ranges_mm);
        let scan = kehai::scan::Scan { geometry: &geometry, ranges_mm, time: opaque(at) };
        module.scan(&session, &scan, opaque(at), &mut Outbox);
        let mut tiles: Tiles = opaque(at);
        tiles.receive(datagram, opaque(at));
        tiles.lost();
        keep(at, module.tiles(&mut tiles, opaque(at), &mut Outbox));
        keep(at, tiles.next_us());
        keep(at, tiles);
        keep(at, module.poll(opaque(at), &mut Outbox));
        keep(at, module.wish());
        module.begin_storing(opaque(at), &mut Outbox);
        keep(
            at,
            module
                .settings_to_store()
                .map(|(settings, trial)| (settings.text().len(), trial.map(|trial| trial.bytes()))),
        );
        keep(at, module.keys_to_store().map(|keyring| keyring.bytes().len()));
        module.end_storing(opaque(at), opaque(at), &mut Outbox);
        // The host's end of a session.
        let mut channel: Channel = opaque(at);
        let mut request: [u8; DATAGRAM_MAX] = opaque(at);
        keep(at, channel.seal(&mut request, opaque(at), opaque(at), opaque(at)));
        keep(at, channel.take(datagram, opaque(at)));
        keep(at, channel);
        keep(at, module);
    }

    fn sensor(at: usize) {
        use kehai::sensor::clock::SensorClock;
        use kehai::sensor::{Action, LineSettings, SensorSettings, Session};
        let line = if opaque(at) {
            LineSettings::NoSpeed
        } else {
            LineSettings::Serial {
                last_baud: Some(opaque(at)),
                wanted_baud: Some(opaque(at)),
                fastest_baud: opaque(at),
            }
        };
        let settings = SensorSettings {
            first_step: Some(opaque(at)),
            last_step: Some(opaque(at)),
            cluster: opaque(at),
            skip: opaque(at),
            line,
            ..SensorSettings::SERIAL
        };
        keep(at, Session::new(settings, opaque(at)));
        let mut session: Session = opaque(at);
        let action = session.poll(opaque(at));
        if let Action::Send(message) = &action {
            keep(at, message.parts().map(<[u8]>::len));
        }
        keep(at, action);
        let mut ranges_mm: [u16; 64] = opaque(at);
        let bytes: [u8; 64] = opaque(at);
        keep(at, session.receive(bytes.get(..opaque(at)).unwrap_or(&bytes), opaque(at), &mut ranges_mm));
        session.link_failed(opaque(at));
        keep(at, session.state_change());
        keep(at, session);
        keep(at, ranges_mm);
        let mut clock: SensorClock = opaque(at);
        clock.begin(opaque(at));
        clock.exchange(opaque(at), opaque(at), opaque(at));
        keep(at, clock.scan(opaque(at), opaque(at)));
        keep(at, clock);
    }

    fn floor(at: usize) {
        use kehai::floor::Floor;
        use kehai::floor::sensfloor::{Layout, SensFloor};
        let mut floor: Floor = opaque(at);
        let bytes: [u8; 64] = opaque(at);
        keep(at, floor.read(bytes.get(..opaque(at)).unwrap_or(&bytes)));
        keep(at, floor.pressed().bytes(floor.panels()).len());
        floor.faulty().for_each(|faulty| keep(at, faulty));
        keep(at, floor);
        keep(at, Floor::new(opaque(at), opaque(at)));
        let mut tiles: SensFloor = opaque(at);
        tiles.receive(bytes.get(..opaque(at)).unwrap_or(&bytes), opaque(at));
        tiles.lost();
        keep(at, tiles.ask(opaque(at)));
        keep(at, tiles.reading(opaque(at)));
        keep(at, (tiles.losses(), tiles.foreign()));
        keep(at, Layout::new(opaque(at), opaque(at), opaque(at)));
        keep(at, tiles);
    }

    fn wire(at: usize) {
        use kehai::wire::{Cookie, DATAGRAM_MAX, Identity, Incoming, Message, ModuleId};
        let mut out: [u8; DATAGRAM_MAX] = opaque(at);
        let bytes: [u8; DATAGRAM_MAX + 1] = opaque(at);
        let datagram = bytes.get(..opaque(at)).unwrap_or(&bytes);
        let identity = Identity { module: ModuleId(opaque(at)), boot: opaque(at) };
        if let Ok(incoming) = Incoming::open(datagram) {
            let request = incoming.request(identity);
            if let Ok(request) = request {
                keep(at, request.encode(identity, opaque(at), Cookie(opaque(at)), &mut out));
            }
            let refused = request.err().map(|refusal| incoming.refused(refusal));
            keep(at, refused.map(|refused| Message::Refused(refused).encode(identity, &mut out)));
        }
        if let Ok((header, message)) = Message::decode(datagram) {
            keep(at, header);
            keep(at, message.encode(identity, &mut out));
            match message {
                Message::Report(report) => {
                    report.candidates.iter().for_each(|candidate| keep(at, candidate));
                    report.unseen.iter().for_each(|span| keep(at, span));
                    report.sizes.iter().for_each(|size| keep(at, size));
                }
                Message::ProfilePart(part) => part.beams.iter().for_each(|beam| keep(at, beam)),
                Message::RawPart(part) => part.ranges_mm.iter().for_each(|range_mm| keep(at, range_mm)),
                Message::Pressed(pressed) => {
                    pressed.down.iter().for_each(|bits| keep(at, bits));
                    pressed.faulty.iter().for_each(|faulty| keep(at, faulty));
                }
                _ => {}
            }
        }
        let judgement: kehai::pipeline::Judgement = opaque(at);
        let report = kehai::wire::Report::of(&judgement, opaque(at), opaque(at));
        keep(at, Message::Report(report).encode(identity, &mut out));
        keep(at, out);
    }
}

/// On a PC there is nothing to prove.
#[cfg(not(target_os = "none"))]
fn main() {}
