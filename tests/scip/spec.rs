//! Protocol facts: replies of recorded sensors, and the vectors of the specification.

use kehai::scan::GeometryParts;
use kehai::scip::*;

const URG: Measurement =
    Measurement { first_step: 44, last_step: 725, cluster: 1, skip: 0, scans: 0, width: Width::Three };

/// Everything a fresh reader that expects `commands` makes of `bytes`.
fn events(commands: &[Command], bytes: &[u8]) -> Vec<Event> {
    let mut reader = Reader::new();
    commands.iter().for_each(|command| reader.expect(&command.encode().unwrap()));
    let (mut events, mut rest, mut ranges_mm) = (Vec::new(), bytes, [0; 1081]);
    while !rest.is_empty() {
        let fed = reader.feed(rest, 7, &mut ranges_mm);
        rest = &rest[fed.consumed..];
        events.extend(fed.event);
    }
    events
}

/// The one event `bytes` make as a reply to `command`.
fn reply(command: Command, bytes: &[u8]) -> Event {
    let events = events(&[command], bytes);
    assert_eq!(events.len(), 1, "{events:?}");
    events[0]
}

fn status(command: Command, bytes: &[u8]) -> Status {
    match reply(command, bytes) {
        Event::Reply(reply) if reply.command == command => reply.status,
        other => panic!("{other:?}"),
    }
}

const URG_VERSION: &[u8] = b"VV\n00P\nVEND:Hokuyo Automatic Co.,Ltd.;[\nPROD:SOKUIKI Sensor URG-04LX;[\n\
    FIRM:3.1.04(02/Aug./2007);a\nPROT:SCIP 2.0;N\nSERI:H0706400;F\n\n";

#[test]
fn the_version_of_a_urg() {
    assert_eq!(URG_VERSION.len(), 132);
    let Event::Version(version) = reply(Command::Version, URG_VERSION) else { panic!() };
    assert_eq!(version.product.as_str(), "SOKUIKI Sensor URG-04LX");
    assert_eq!(version.firmware.as_str(), "3.1.04(02/Aug./2007)");
    assert_eq!(version.protocol.as_str(), "SCIP 2.0");
    assert_eq!(version.serial.as_str(), "H0706400");
}

#[test]
fn a_wrong_checksum_of_seri_and_a_stray_line_do_not_cost_the_version() {
    let mut bytes = URG_VERSION.to_vec();
    let sum = bytes.len() - 3;
    assert_eq!(bytes[sum], b'F');
    bytes[sum] = b'G';
    bytes.splice(sum + 2..sum + 2, *b"stray line\n");
    let events = events(&[Command::Version], &bytes);
    let [Event::Lost(stray), Event::Version(version)] = events[..] else { panic!("{events:?}") };
    assert_eq!(stray, Loss { cause: LossCause::InfoLine, dropped: Dropped::Line });
    assert_eq!(version.serial.as_str(), "H0706400");
}

const URG_PARAMETERS: &[u8] =
    b"PP\n00P\nMODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N\nDMIN:20;4\nDMAX:5600;_\n\
    ARES:1024;\\\nAMIN:44;7\nAMAX:725;o\nAFRT:384;6\nSCAN:600;e\n\n";

#[test]
fn the_parameters_of_a_urg() {
    assert_eq!(URG_PARAMETERS.len(), 128);
    let Event::Parameters(urg) = reply(Command::Parameters, URG_PARAMETERS) else { panic!() };
    assert_eq!(urg.model.as_str(), "URG-04LX");
    let all = urg.measure_all(1, Width::Three);
    assert_eq!(all, URG);
    let parts = GeometryParts {
        first_step: 44,
        last_step: 725,
        cluster: 1,
        front_step: 384,
        steps_per_turn: 1024,
        period_us: 100_000,
        range_min_mm: 20,
        range_max_mm: 5600,
    };
    assert_eq!(urg.geometry(&all).unwrap().parts(), parts);
}

#[test]
fn the_parameters_of_a_utm_and_a_uxm() {
    let utm = b"PP\n00P\nMODL:UTM-30LX(Hokuyo Automatic Co.,Ltd.);U\nDMIN:23;7\nDMAX:60000;J\nARES:1440;^\n\
        AMIN:0;?\nAMAX:1080;Z\nAFRT:540;0\nSCAN:2400;U\n\n";
    let Event::Parameters(utm) = reply(Command::Parameters, utm) else { panic!() };
    assert_eq!((utm.model.as_str(), utm.first_step), ("UTM-30LX", 0));
    assert_eq!(utm.measure_all(1, Width::Three).beams(), 1081);
    // The recording gives the seven numbers of this model, not the line of its name.
    let uxm =
        b"PP\n00P\nDMIN:100;c\nDMAX:100000;5\nARES:1440;^\nAMIN:0;?\nAMAX:760;n\nAFRT:380;2\nSCAN:1200;R\n\n";
    let Event::Parameters(uxm) = reply(Command::Parameters, uxm) else { panic!() };
    assert_eq!(uxm.geometry(&uxm.measure_all(1, Width::Three)).unwrap().beams(), 761);
}

#[test]
fn parameters_are_strict() {
    let loss = |from: &str, to: &str| {
        let text = String::from_utf8(URG_PARAMETERS.to_vec()).unwrap();
        assert!(text.contains(from));
        match reply(Command::Parameters, text.replacen(from, to, 1).as_bytes()) {
            Event::Lost(Loss { cause, dropped: Dropped::Reply(Command::Parameters) }) => cause,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(loss("DMIN:20", "DMIN:21"), LossCause::Checksum);
    assert_eq!(loss("DMIN:20;4", "DMIN:20 4"), LossCause::InfoLine);
    assert_eq!(loss("DMIN:20;4\n", ""), LossCause::Parameters);
    assert_eq!(loss("AMIN:44;7", "aMIN:44;W"), LossCause::Parameters);
}

#[test]
fn the_state_of_a_urg() {
    let bytes = b"II\n00P\nMODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N\nLASR:ON;9\n\
        SCSP:Initial(600[rpm])<-Default setting by user;A\nMESM:CLASSIC;^\n\
        SBPS:19200[bps]<-Default setting by user;A\nTIME:6A5404;]\nSTAT:Sensor works well.;8\n\n";
    let Event::State(state) = reply(Command::State, bytes) else { panic!() };
    assert_eq!(state.laser_on, Some(true));
    assert_eq!(state.speed_rpm, Some(600));
    assert_eq!(state.mode.as_str(), "CLASSIC");
    assert_eq!(state.bit_rate_baud, Some(19_200));
    assert_eq!(state.stamp_ms, Some(6_968_324));
    assert_eq!(state.condition.as_str(), "Sensor works well.");
}

#[test]
fn a_clock_with_a_semicolon_is_read_to_its_end() {
    let line = |text: &[u8]| [text, b";", &[checksum::of(text)], b"\n"].concat();
    let bytes = [b"II\n00P\n".to_vec(), line(b"TIME:j;o["), b"\n".to_vec()].concat();
    assert_eq!(bytes, b"II\n00P\nTIME:j;o[;H\n\n");
    let Event::State(state) = reply(Command::State, &bytes) else { panic!() };
    assert_eq!(state.stamp_ms, encoding::decode(b"j;o["));
    assert!(state.stamp_ms.is_some());
}

#[test]
fn one_odd_line_of_a_state_costs_only_itself() {
    let bytes = b"II\n00P\nLASR:ON;8\nTIME:6A5404;]\n\n";
    let events = events(&[Command::State], bytes);
    let [Event::Lost(loss), Event::State(state)] = events[..] else { panic!("{events:?}") };
    assert_eq!(loss, Loss { cause: LossCause::Checksum, dropped: Dropped::Line });
    assert_eq!((state.laser_on, state.stamp_ms), (None, Some(6_968_324)));
}

#[test]
fn replies_without_data() {
    assert_eq!(status(Command::LaserOn, b"BM\n02R\n\n"), Status::ALREADY);
    assert_eq!(status(Command::LaserOn, b"BM\n00P\n\n"), Status::OK);
    assert_eq!(status(Command::TimeEnter, b"TM0\n00P\n\n"), Status::OK);
    assert_eq!(status(Command::TimeLeave, b"TM2\n00P\n\n"), Status::OK);
    assert_eq!(status(Command::Quit, b"QT\n00P\n\n"), Status::OK);
    assert_eq!(status(Command::Reboot, b"RB\n01Q\n\n"), Status(*b"01"));
    assert_eq!(status(Command::BitRate(115_200), b"SS115200\n03S\n\n"), Status::ALREADY_AT_RATE);
    assert_eq!(status(Command::Parameters, b"PP\n0Ee\n\n"), Status::NOT_DEFINED);
    assert_eq!(status(Command::Scip20, b"SCIP2.0\n0Ee\n\n"), Status::NOT_DEFINED);
    assert_eq!(status(Command::TimeRead, b"TM1\n04T\n\n"), Status(*b"04"));
    assert_eq!(status(Command::Get(URG), b"GD0044072501\n10Q\n\n"), Status::DENIED);
}

#[test]
fn the_clock_of_a_uxm() {
    let Event::Time(time) = reply(Command::TimeRead, b"TM1\n00P\n<SfkP\n\n") else { panic!() };
    assert_eq!(time, TimeReply { stamp_ms: 3_292_603, first_byte_us: 7 });
}

#[test]
fn a_tagged_clock_reply_must_carry_the_tag() {
    let mut reader = Reader::new();
    reader.expect(&Command::TimeRead.encode_tagged(b"k2").unwrap());
    let mut bytes = &b"TM1;k1\n00P\n<SfkP\n\nTM1;k2\n00P\n<SfkP\n\n"[..];
    let mut events = Vec::new();
    while !bytes.is_empty() {
        let fed = reader.feed(bytes, 0, &mut []);
        bytes = &bytes[fed.consumed..];
        events.extend(fed.event);
    }
    let awaited = Event::Time(TimeReply { stamp_ms: 3_292_603, first_byte_us: 0 });
    assert_eq!(events, [Event::Unexpected(Status::OK), awaited]);
}

#[test]
fn state_codes() {
    let code = |digits: &[u8]| {
        let bytes = [b"%ST\n00P\n", digits, &[checksum::of(digits)], b"\n\n"].concat();
        reply(Command::StateCode, &bytes)
    };
    assert_eq!(code(b"004"), Event::StateCode(StateCode::MultiScan));
    assert_eq!(code(b"900"), Event::StateCode(StateCode::Error));
    assert_eq!(status(Command::StateCode, b"%ST\n0Ff\n\n"), Status::NOT_SUPPORTED);
}

#[test]
fn scip_1_1_is_told_from_scip_2() {
    let scip11 = |command, status| Event::Scip11(Scip11Reply { command, status });
    assert_eq!(reply(Command::Scip20, b"SCIP2.0\n0\n\n"), scip11(Command::Scip20, b'0'));
    assert_eq!(reply(Command::Quit, b"QT\nE\n\n"), scip11(Command::Quit, b'E'));
    let late = reply(Command::Quit, b"V\n0\nVEND:Hokuyo Automatic Co.,Ltd.\nSTAT:FW Normal[FinalDist]\n\n");
    assert_eq!(late, Event::Unexpected(Status(*b"0 ")));
}

#[test]
fn a_stream_starts_pauses_and_goes_on() {
    let echo = b"MD0044072501000\n";
    let bytes: Vec<u8> = ["00P", "0Mm", "23U", "98a", "0Ll", "60V"]
        .iter()
        .flat_map(|s| [echo, s.as_bytes(), b"\n\n"].concat())
        .collect();
    let statuses: Vec<_> = events(&[Command::Measure(URG)], &bytes)
        .iter()
        .map(|event| match event {
            Event::Reply(Reply { command: Command::Measure(_), status, .. }) => status.of_measurement(),
            other => panic!("{other:?}"),
        })
        .collect();
    use MeasurementStatus::*;
    assert_eq!(statuses, [Accepted, Unstable, Verifying, Resumed, Abnormal, Hardware]);
}

#[test]
fn a_counted_stream_says_what_remains() {
    let two = Measurement { first_step: 10, last_step: 11, scans: 2, ..URG };
    let bytes = b"MD0010001101002\n00P\n\nMD0010001101001\n99b\nJUGnD\n00D1Dh1\n\n\
        MD0010001101000\n99b\n<SfkP\n00D1Dh1\n\n";
    let events = events(&[Command::Measure(two)], bytes);
    let [Event::Reply(_), Event::Scan(first), Event::Scan(second)] = events[..] else { panic!("{events:?}") };
    let header = ScanHeader { streamed: true, stamp_ms: 6_968_830, beams: 2, remaining: 1, first_byte_us: 7 };
    assert_eq!(first, header);
    assert_eq!(second, ScanHeader { stamp_ms: 3_292_603, remaining: 0, ..header });
}

#[test]
fn a_two_character_scan_and_a_single_one() {
    let short = Measurement { first_step: 10, last_step: 11, width: Width::Two, ..URG };
    let Event::Scan(scan) = reply(Command::Get(short), b"GS0010001101\n00P\nJUGnD\nCB0Ch\n\n") else {
        panic!()
    };
    assert_eq!((scan.streamed, scan.beams, scan.stamp_ms), (false, 2, 6_968_830));
}

#[test]
fn quitting_while_scans_still_arrive() {
    let two = Measurement { first_step: 10, last_step: 11, ..URG };
    let scan = b"MD0010001101000\n99b\nJUGnD\n00D1Dh1\n\n";
    let bytes = [&scan[..], scan, b"QT\n00P\n\nQT\n00P\n\n", scan].concat();
    let events = events(&[Command::Measure(two), Command::Quit], &bytes);
    let [Event::Scan(_), Event::Scan(_), Event::Reply(quit), Event::Unexpected(Status::OK), Event::Scan(_)] =
        events[..]
    else {
        panic!("{events:?}")
    };
    assert_eq!((quit.command, quit.status), (Command::Quit, Status::OK));
}
