//! A recording as the source, and faults on the line, in requests and of the client.

use super::*;

#[test]
fn a_recording_begins_at_the_first_running_measurement_and_ends() {
    let row = |offset_us, delay_us, value_mm| (offset_us, delay_us, vec![value_mm; 682]);
    let rows = vec![row(0, 100_000, 1000), row(100_000, 390_000, 2000), row(200_000, 291_000, 3000)];
    let mut urg = Client::with(fast(URG_04LX), Box::new(Rows::new(URG_04LX.geometry, rows)));
    urg.ask("BM");
    assert!(urg.ask("GS0044004401").contains("\n?XG\n"), "1000 mm: the first row");
    let begun_us = urg.now_us + 100_000;
    urg.ask("MS0044004401000");
    let truth: Vec<_> = urg.urg.truth().map(|truth| (truth.start_us, truth.queued_us)).collect();
    let expected =
        [(0, 100_000), (100_000, 490_000), (200_000, 491_000)].map(|(a, b)| (begun_us + a, begun_us + b));
    assert_eq!(truth, expected, "a stall with a scan that catches up");
    assert!(urg.urg.source_ended());
    assert_eq!(urg.urg.state(), State::Streaming);
}

#[test]
fn a_stall_holds_everything_back_and_then_catches_up() {
    let faults = vec!["stall:1,0.39".parse().unwrap()];
    let mut urg = Client::new(Config { start: Start::Streaming, faults, ..fast(URG_04LX) });
    urg.hear("", 1_000_000);
    assert_eq!(urg.hear("", 389_000), "");
    assert_eq!(urg.hear("", 2_000).matches("99b\n").count(), 4);
    let stamps: Vec<_> = urg.urg.truth().map(|truth| truth.stamp_ms).collect();
    assert!(stamps.windows(2).all(|pair| pair[1] - pair[0] == 100), "no scan is lost: {stamps:?}");
}

#[test]
fn faults_in_the_stream_do_what_they_say() {
    let run = |fault: &str| {
        let faults = vec![fault.parse().unwrap()];
        let mut urg = Client::new(Config { start: Start::Streaming, faults, ..fast(URG_04LX) });
        urg.urg.receive(b"", 0);
        urg.now_us = 3_000_000;
        let sent = urg.urg.take_output(3_000_000);
        let bytes: Vec<u8> = sent.into_iter().flat_map(|sent| sent.bytes).collect();
        (bytes, urg.urg.counts())
    };
    let (healthy, _) = run("ignore-qt:1");
    let scans = healthy.len() / 2137;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (unstable, counts) = run("unstable:5");
    assert_eq!(text(&unstable).matches("\n0Mm\n\n").count() as u64, counts.faults);
    assert_eq!(counts.faults, scans as u64 / 5);
    assert_eq!(run("overrun:10,16").0.len(), healthy.len() - scans / 10 * 16);
    assert!(run("half-scan:10").0.len() < healthy.len());
    assert_eq!(text(&run("foreign-reply:10").0).matches("\nII\n00P\nMODL:").count(), scans / 10);
    let (flipped, counts) = run("bit-flip:0.001");
    assert_eq!(flipped.len(), healthy.len());
    assert_eq!(flipped.iter().zip(&healthy).filter(|(a, b)| a != b).count() as u64, counts.faults);
    assert!(counts.faults > 20);
    assert_eq!(run("lost-byte:0.001").0.len() as u64 + run("lost-byte:0.001").1.faults, healthy.len() as u64);
    assert_eq!(
        run("extra-byte:0.001").0.len() as u64,
        healthy.len() as u64 + run("extra-byte:0.001").1.faults
    );
    assert_eq!(run("garbage:64").0.len(), healthy.len() + 64);
    let (stuck, _) = run("stuck:1,1");
    let stamps: Vec<String> =
        text(&stuck).split("\n99b\n").skip(1).map(|scan| scan[..5].to_owned()).collect();
    let repeated = stamps.windows(2).filter(|pair| pair[0] == pair[1]).count();
    assert_eq!(repeated, 9, "ten scans in a second: {stamps:?}");
    assert_ne!(stamps.first(), stamps.last());
}

#[test]
fn faults_of_requests_do_what_they_say() {
    let client =
        |model, fault: &str| Client::new(Config { faults: vec![fault.parse().unwrap()], ..fast(model) });
    let mut deaf = client(URG_04LX, "ignore-qt:2");
    assert_eq!([deaf.ask("QT"), deaf.ask("QT"), deaf.status("QT")], ["", "", "00"]);
    let mut busy = client(UST_10LX, "tm-busy:1");
    assert_eq!([busy.status("TM0"), busy.status("TM0")], ["10", "00"]);
    let version = client(URG_04LX, "bad-vv").ask("VV");
    assert!(version.ends_with("\n0000\n\n"), "{version}");
    let mut wedged = client(URG_04LX, "wedge");
    assert_eq!([wedged.ask("ME0044072501000"), wedged.ask("VV"), wedged.ask("RS")], ["", "", ""]);
    wedged.urg.power_cycle(wedged.now_us, 1_000_000);
    wedged.hear("", 4_000_000);
    assert_eq!(wedged.ask("V").get(..4), Some("V\n0\n"));
    let mut silent = client(UST_10LX, "rb-silent");
    assert_eq!([silent.hear("RB\n", 10_000), silent.hear("RB\n", 10_000)], ["RB\n01Q\n\n", ""]);
    silent.hear("", 1_100_000);
    assert_eq!((silent.urg.state(), silent.urg.link()), (State::Off, LinkState::Closed));
    silent.hear("", 300_000);
    assert_eq!((silent.urg.state(), silent.urg.link()), (State::Booting, LinkState::Up));
    let mut slow = client(UST_10LX, "slow-sl:0.8");
    assert_eq!(slow.hear("%SL\n", 790_000), "");
    assert_eq!(slow.hear("", 20_000), "%SL\n00P\n\n");
    assert_eq!(slow.ask("%ST"), "%ST\n00P\n005E\n\n");
}

#[test]
fn fault_drills_stop_or_interrupt_a_long_measurement() {
    let run = |drill: &str| {
        let mut urg = Client::new(fast(URG_04LX));
        assert_eq!(urg.status(drill), "00");
        let all = urg.hear("MS0044004401000\n", 6_000_000);
        let statuses: Vec<_> = all.lines().filter(|line| ["21S", "98a", "50U"].contains(line)).collect();
        (statuses.len(), statuses.last().copied().unwrap_or_default().to_owned(), urg)
    };
    let (count, last, _) = run("DB03");
    assert_eq!((count, last.as_str()), (11, "98a"));
    let (count, last, _) = run("DB04");
    assert_eq!((count, last.as_str()), (11, "50U"));
    let (count, last, mut urg) = run("DB05");
    assert_eq!((count, last.as_str(), urg.urg.state()), (1, "50U", State::Abnormal));
    assert!(urg.ask("II").contains("STAT:Trouble!! Error No. =[00->33];"));
    assert_eq!([urg.status("MD0044072501000"), urg.status("DB02"), urg.status("DB10")], ["50", "05", "00"]);
    assert_eq!([urg.status("MD0044072501001"), urg.status("DBx2"), urg.status("DB77")], ["00", "01", "02"]);
}

#[test]
fn a_vanished_client_stops_an_ethernet_sensor_only() {
    let left = |model| {
        let mut client = Client::new(Config { start: Start::Streaming, ..fast(model) });
        client.urg.client_left(500_000);
        client.urg.state()
    };
    assert_eq!(left(UST_10LX), State::Idle);
    assert_eq!(left(URG_04LX), State::Streaming);
}
