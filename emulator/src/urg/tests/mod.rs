//! Transcripts with an emulated sensor: what real ones are known to say, and every refusal.

mod faults;
mod start_states;

use super::model::{MODELS, QuitInTimeSync, UHG_08LX, URG_04LX, URG_04LX_UG01, UST_10LX, UTM_30LX};
use super::*;
use crate::source::{Rows, StillRoom};

/// A sensor under test, and the time it lives at.
struct Client {
    urg: Urg,
    now_us: u64,
}

impl Client {
    fn new(config: Config) -> Self {
        let room = StillRoom::new(config.model.geometry);
        Self::with(config, Box::new(room))
    }

    fn with(config: Config, source: Box<dyn RangeSource>) -> Self {
        Self { urg: Urg::new(config, source, 0), now_us: 0 }
    }

    /// Sends a text and returns all that comes within `for_us`.
    fn hear(&mut self, text: &str, for_us: u64) -> String {
        self.urg.receive(text.as_bytes(), self.now_us);
        self.now_us += for_us;
        let sent = self.urg.take_output(self.now_us);
        let bytes = sent.into_iter().flat_map(|sent| sent.bytes).collect();
        String::from_utf8(bytes).expect("plain characters")
    }

    /// Sends a request and returns what comes within a second.
    fn ask(&mut self, request: &str) -> String {
        self.hear(&format!("{request}\n"), 1_000_000)
    }

    /// The status of the answer to a request.
    fn status(&mut self, request: &str) -> String {
        let answer = self.ask(request);
        let rest = answer.strip_prefix(request).unwrap_or_else(|| panic!("{request}: {answer:?}"));
        rest.get(1..3).unwrap_or_default().to_owned()
    }
}

fn fast(model: Model) -> Config {
    Config { paced: false, clock_fast_ppm: 0, ..Config::new(model) }
}

#[test]
fn a_urg_answers_as_recorded() {
    let model = Model { firmware: "3.1.04(02/Aug./2007)", serial: "H0706400", ..URG_04LX };
    // 1 ms before the `II` of the recording was answered.
    let config = Config { clock_start_ms: 0x6A_5404 - 3100, ..fast(model) };
    let mut urg = Client::new(config);
    assert_eq!(
        urg.ask("VV"),
        "VV\n00P\nVEND:Hokuyo Automatic Co.,Ltd.;[\nPROD:SOKUIKI Sensor URG-04LX;[\n\
         FIRM:3.1.04(02/Aug./2007);a\nPROT:SCIP 2.0;N\nSERI:H0706400;F\n\n"
    );
    assert_eq!(
        urg.ask("PP"),
        "PP\n00P\nMODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N\nDMIN:20;4\nDMAX:5600;_\nARES:1024;\\\n\
         AMIN:44;7\nAMAX:725;o\nAFRT:384;6\nSCAN:600;e\n\n"
    );
    assert_eq!(urg.ask("BM"), "BM\n00P\n\n");
    assert_eq!(
        urg.ask("II"),
        "II\n00P\nMODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N\nLASR:ON;9\n\
         SCSP:Initial(600[rpm])<-Default setting by user;A\nMESM:CLASSIC;^\n\
         SBPS:19200[bps]<-Default setting by user;A\nTIME:6A5404;]\nSTAT:Sensor works well.;8\n\n"
    );
    assert_eq!(urg.ask("BM"), "BM\n02R\n\n");
    assert_eq!(urg.ask("CR00"), "CR00\n03S\n\n");
    let scan = urg.ask("GD0044072501");
    assert!(scan.starts_with("GD0044072501\n00P\n"));
    assert_eq!((scan.len(), scan.lines().count()), (2134, 2 + 1 + 32 + 1));
}

#[test]
fn the_other_models_state_their_recorded_parameters() {
    let lines = |model| Client::new(fast(model)).ask("PP");
    assert_eq!(
        lines(UTM_30LX),
        "PP\n00P\nMODL:UTM-30LX(Hokuyo Automatic Co.,Ltd.);U\nDMIN:23;7\nDMAX:60000;J\nARES:1440;^\n\
         AMIN:0;?\nAMAX:1080;Z\nAFRT:540;0\nSCAN:2400;U\n\n"
    );
    assert!(lines(UST_10LX).contains("MODL:UST-10LX;"));
    assert_eq!(lines(URG_04LX_UG01), lines(URG_04LX));
    assert!(lines(UHG_08LX).contains("\nAMAX:768;") && lines(UHG_08LX).contains("\nSCAN:900;"));
    assert_eq!(Client::new(fast(UTM_30LX)).ask("CR00"), "CR00\n04T\n\n");
}

#[test]
fn the_time_sync_state_answers_at_once_and_refuses_the_rest() {
    let mut urg = Client::new(Config { clock_start_ms: 3_292_603 - 1000, ..fast(URG_04LX) });
    assert_eq!(urg.ask("TM0"), "TM0\n00P\n\n");
    assert_eq!(urg.hear("TM1\n", 500), "TM1\n00P\n<SfkP\n\n");
    assert_eq!(urg.status("TM0"), "02");
    for refused in ["PP", "BM", "QT", "MD0044072501000", "SS115200", "GD0044072500"] {
        assert_eq!(urg.status(refused), "0E", "{refused}");
    }
    assert_eq!([urg.status("VV"), urg.status("II"), urg.status("RS")], ["00", "00", "00"]);
    assert_eq!(urg.urg.state(), State::TimeSync);
    assert_eq!(urg.ask("TM2"), "TM2\n00P\n\n");
    assert_eq!(
        [urg.status("TM1"), urg.status("TM2"), urg.status("TM3"), urg.status("TM")],
        ["04", "03", "01", "0C"]
    );
    urg.ask("MD0044072501000");
    assert!(urg.ask("TM0").contains("\nTM0\n10Q\n\n"));
}

#[test]
fn a_scip22_sensor_leaves_time_sync_by_quitting_and_has_its_own_refusals() {
    let mut ust = Client::new(Config { start: Start::TimeSync, ..fast(UST_10LX) });
    assert_eq!(ust.status("BM"), "10");
    assert_eq!(ust.ask("%ST"), "%ST\n00P\n002B\n\n");
    assert_eq!(ust.status("QT"), "00");
    assert_eq!(ust.ask("%ST"), "%ST\n00P\n000@\n\n");
    for unknown in ["XX", "SS115200", "DB02", "MX0000108001000", "hello"] {
        assert_eq!(ust.ask(unknown), format!("{unknown}\n0Ff\n\n"));
    }
    assert_eq!(
        [ust.status("MD"), ust.status("ME"), ust.status("GD"), ust.status("GE")],
        ["0C", "0C", "10", "10"]
    );
    assert_eq!([ust.status("HS1"), ust.status("CR00"), ust.status("VVV")], ["03", "04", "0D"]);
    let mut urg = Client::new(fast(URG_04LX));
    for unknown in ["XX", "%ST", "RB", "ND0044072501000", "ME0044072501000", "SCIP2.0", "X"] {
        assert_eq!(urg.status(unknown), "0E", "{unknown}");
    }
    assert_eq!([urg.status("GD"), urg.status("MD00440725010000"), urg.status("T")], ["0C", "0D", "0E"]);
}

#[test]
fn strings_come_back_in_every_scan_and_wrong_ones_are_refused() {
    let mut urg = Client::new(fast(URG_04LX));
    assert_eq!(urg.ask("QT;stop@16._+ az09"), "QT;stop@16._+ az09\n00P\n\n");
    assert_eq!(urg.ask("QT;12345678901234567"), "QT;12345678901234567\n0Gg\n\n");
    assert_eq!(urg.ask("QT;a-b"), "QT;a-b\n0Hh\n\n");
    let scans = urg.ask("MD0044004400002;a");
    assert_eq!(scans.matches("MD0044004400001;a\n99b\n").count(), 1, "{scans}");
    assert!(scans.starts_with("MD0044004400002;a\n00P\n\nMD0044004400001;a\n99b\n"));
    assert!(scans.contains("MD0044004400000;a\n99b\n"));
}

#[test]
fn requests_come_in_pieces_with_any_terminator_and_several_at_once() {
    let mut urg = Client::new(fast(UTM_30LX));
    assert_eq!(urg.hear("V", 40_000), "");
    assert_eq!(urg.hear("V", 40_000), "");
    assert!(urg.hear("\r\n", 40_000).starts_with("VV\n00P\n"));
    assert_eq!(urg.hear("\n\n\nBM\rQT\r\n\nTM2\n", 40_000), "BM\n00P\n\nQT\n00P\n\nTM2\n03S\n\n");
    assert_eq!(urg.hear("QT\nQT\n", 40_000), "QT\n00P\n\nQT\n0Bb\n\n");
}

#[test]
fn replies_keep_to_the_rhythm_of_the_model() {
    let answered_us = |model, request: &str| {
        let mut client = Client::new(fast(model));
        client.now_us = 12_345;
        client.urg.receive(request.as_bytes(), client.now_us);
        client.urg.next_due_us().unwrap()
    };
    assert_eq!(answered_us(URG_04LX, "VV\n"), 100_000);
    assert_eq!(answered_us(UTM_30LX, "VV\n"), 25_000);
    assert_eq!(answered_us(UST_10LX, "VV\n"), 13_000);
}

#[test]
fn measurements_are_refused_with_the_published_codes() {
    let mut urg = Client::new(fast(URG_04LX));
    assert_eq!(urg.status("GD0044072501"), "10");
    urg.ask("BM");
    for (request, status) in [
        ("GD0044072501", "00"),
        ("GD00x4072501", "01"),
        ("GD004407x501", "02"),
        ("GS00440725x1", "03"),
        ("GD0044076901", "04"),
        ("GD0725004401", "05"),
        ("MD004407250x000", "03"),
        ("MD0044072501x00", "06"),
        ("MD00440725010xx", "07"),
        ("MS0000076801001", "00"),
    ] {
        assert_eq!(urg.status(request), status, "{request}");
    }
}

#[test]
fn replies_have_the_sizes_of_the_table() {
    let scan = |model: Model, command: &str| {
        let mut client = Client::new(fast(model));
        let all = client.ask(command);
        all.len() - (command.len() + 6)
    };
    for (last, size) in [(681, [1435, 2137]), (725, [1525, 2275])] {
        assert_eq!(scan(URG_04LX, &format!("MS0000{last:04}01001")), size[0]);
        assert_eq!(scan(URG_04LX, &format!("MD0000{last:04}01001")), size[1]);
    }
    assert_eq!(scan(UHG_08LX, "MS0000076801001"), 1615);
    assert_eq!(scan(UHG_08LX, "MD0000076801001"), 2408);
    assert_eq!(scan(UTM_30LX, "ME0000068101001"), 4247);
    assert_eq!(scan(UTM_30LX, "MS0000108001001"), 2257);
    assert_eq!(scan(UTM_30LX, "MD0000108001001"), 3372);
    assert_eq!(scan(UTM_30LX, "ME0000108001001"), 6717);
}

#[test]
fn a_count_runs_down_to_zero_and_the_laser_goes_off() {
    let mut ust = Client::new(fast(UST_10LX));
    let all = ust.ask("ME0000108001103");
    let echoes: Vec<_> = all.lines().filter(|line| line.starts_with("ME")).collect();
    assert_eq!(echoes, ["ME0000108001103", "ME0000108001102", "ME0000108001101", "ME0000108001100"]);
    assert_eq!((ust.urg.laser(), ust.urg.state()), (false, State::Idle));
    let starts: Vec<_> = ust.urg.truth().map(|truth| truth.start_us).collect();
    assert_eq!(starts, [25_000, 75_000, 125_000], "skip 1 leaves out every second scan");
}

#[test]
fn scans_come_every_99_7_ms_with_stamps_of_a_fast_clock() {
    let mut urg = Client::new(Config { paced: false, clock_start_ms: 0xff_ff00, ..Config::new(URG_04LX) });
    urg.hear("MD0044072501000\n", 10_000_000);
    let truth: Vec<_> = urg.urg.truth().collect();
    assert_eq!(truth.len(), 99);
    for pair in truth.windows(2) {
        assert!((99_700..=99_702).contains(&(pair[1].start_us - pair[0].start_us)));
        let step_ms = pair[1].stamp_ms.wrapping_sub(pair[0].stamp_ms) & 0xff_ffff;
        assert!((99..=101).contains(&step_ms));
    }
    assert!(truth[0].stamp_ms > truth[9].stamp_ms, "the stamp has wrapped");
}

#[test]
fn a_slow_line_loses_whole_scans_and_a_fast_one_none() {
    let sent = |baud| {
        let mut urg = Client::new(Config { baud, ..Config::new(URG_04LX) });
        let bytes = urg.hear("MD0044072501000\n", 10_000_000);
        let whole = bytes.matches("99b\n").count();
        (whole, urg.urg.counts().scans_dropped)
    };
    assert_eq!(sent(250_000), (99, 0));
    let (whole, dropped) = sent(115_200);
    assert!((49..=51).contains(&whole) && dropped >= 48, "{whole} sent, {dropped} dropped");
    assert!((8..=9).contains(&sent(19_200).0));
}

#[test]
fn a_scan_under_way_is_delivered_before_the_answer_to_quit() {
    let mut urg = Client::new(Config { start: Start::Streaming, baud: 250_000, ..Config::new(URG_04LX) });
    urg.hear("", 230_000);
    let rest = urg.hear("QT\n", 1_000_000);
    let (scans, _) = rest.split_once("\nQT\n00P\n\n").expect("an answer to QT");
    assert!(scans.contains("99b\n"), "the revolution that ended with the answer is still sent");
    assert!(rest.ends_with("\nQT\n00P\n\n"), "nothing follows it");
}

#[test]
fn the_answer_to_ss_comes_at_the_old_speed_and_the_next_one_at_the_new() {
    let mut urg = Client::new(Config::new(URG_04LX));
    let speeds = |urg: &mut Client, request: &[u8]| {
        urg.urg.receive(request, urg.now_us);
        urg.now_us += 500_000;
        let sent = urg.urg.take_output(urg.now_us);
        sent.into_iter().map(|sent| sent.baud.unwrap()).collect::<Vec<_>>()
    };
    urg.urg.receive(b"SS115200\n", 0);
    // The answer begins with the next revolution and takes 14 bytes, 7.3 ms.
    urg.urg.advance(99_700 + 7000);
    assert_eq!(urg.urg.baud(), 19_200, "still answering");
    assert_eq!(speeds(&mut urg, b""), [19_200]);
    assert_eq!(speeds(&mut urg, b"VV\n"), [115_200]);
    assert_eq!(urg.urg.baud(), 115_200);
    assert_eq!([urg.status("SS115200"), urg.status("SS038400"), urg.status("SS11520x")], ["03", "02", "01"]);
    assert_eq!(speeds(&mut urg, b"RT\n"), [115_200]);
    assert_eq!(speeds(&mut urg, b"RS\n"), [115_200]);
    assert_eq!(urg.urg.baud(), 19_200);
}

#[test]
fn a_sensor_without_a_line_speed_drops_whole_scans_while_its_reader_is_behind() {
    let mut utm = Client::new(Config { start: Start::Streaming, ..fast(UTM_30LX) });
    assert_eq!(utm.hear("", 260_000).matches("\n99b\n").count(), 9);
    utm.urg.set_reader_behind(true);
    assert_eq!(utm.hear("QT;hello\n", 250_000), "QT;hello\n00P\n\n", "answers are sent");
    utm.urg.set_reader_behind(false);
    assert_eq!(utm.urg.counts().scans_dropped, 1, "the one before the answer");
}

#[test]
fn a_sensor_that_breaks_says_so_in_its_stream_and_ends_it() {
    let faults = vec!["abnormal:0.25".parse().unwrap()];
    let mut urg = Client::new(Config { start: Start::Streaming, faults, ..fast(UST_10LX) });
    let all = urg.hear("", 1_000_000);
    assert!(all.ends_with("\n\nMD0000108001000\n0Ll\n\n"), "{}", &all[all.len() - 100..]);
    assert_eq!((urg.urg.state(), urg.status("RS")), (State::Abnormal, "0L".to_owned()));
}

#[test]
fn a_slower_motor_makes_longer_revolutions_until_it_is_reset() {
    let mut urg = Client::new(fast(URG_04LX));
    assert_eq!(
        [urg.status("CR10"), urg.status("CR10"), urg.status("CR11"), urg.status("CRx0")],
        ["00", "03", "02", "01"]
    );
    assert_eq!(urg.urg.period_us(), 111_111);
    assert!(urg.ask("II").contains("SCSP:10%....(540[rpm]);"));
    assert_eq!([urg.status("HS1"), urg.status("HS1"), urg.status("HSx")], ["00", "02", "01"]);
    assert!(urg.urg.high_sensitivity());
    assert_eq!(urg.status("RT"), "00");
    assert_eq!((urg.urg.period_us(), urg.urg.high_sensitivity()), (111_111, false));
    assert_eq!(urg.status("RS"), "00");
    assert_eq!(urg.urg.period_us(), 100_000);
}

#[test]
fn a_last_group_that_is_not_full_is_sent_or_left_out() {
    let values = |drop_incomplete_group| {
        let mut urg = Client::new(Config { drop_incomplete_group, ..fast(URG_04LX) });
        let all = urg.ask("MS0044005003001");
        all.lines().nth_back(1).expect("a data line").len() / 2
    };
    assert_eq!((values(false), values(true)), (3, 2));
}

#[test]
fn a_booting_scip22_sensor_answers_but_does_not_measure() {
    let mut ust = Client::new(Config { start: Start::Booting, ..fast(UST_10LX) });
    let answers = ust.hear("%ST\nTM0\nBM\nVV\n", 10_000);
    assert!(answers.starts_with("%ST\n00P\n001A\n\nTM0\n10Q\n\nBM\n01Q\n\nVV\n00P\n"), "{answers}");
    ust.hear("", 2_000_000);
    assert_eq!(ust.status("BM"), "00");
}
