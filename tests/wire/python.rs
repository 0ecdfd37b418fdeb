//! `examples/python/kehai_wire.py` understands the same bytes as the library.

use std::io::{BufRead, BufReader};
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use kehai::candidate::Candidate;
use kehai::unseen::UnseenSpan;
use kehai::wire::{
    Alarms, Cookie, Counter, DATAGRAM_MAX, Event, Health, Identity, Incoming, Info, LearningProgress,
    Message, ModuleId, PartHead, Pressed, Refusal, Report, Request, SensorInfo, Size,
};
use serde_json::{Map, Value, json};

fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The script, ready to run; nothing where there is no Python, which CI must have.
fn script() -> Option<Command> {
    if Command::new("python3").arg("--version").output().is_err() {
        test_support::fail_in_ci_else_skip("no python3");
        return None;
    }
    let mut command = Command::new("python3");
    command.arg(project().join("examples/python/kehai_wire.py"));
    Some(command)
}

/// Golden datagrams of modules, with their files.
fn golden() -> Vec<(PathBuf, Vec<u8>)> {
    let files =
        std::fs::read_dir(project().join("tests/data/wire")).unwrap().map(|file| file.unwrap().path());
    let bytes = |path: &Path| -> Vec<u8> {
        let text = std::fs::read_to_string(path).unwrap();
        text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
    };
    let all = files.map(|path| (path.clone(), bytes(&path)));
    let mut golden: Vec<_> = all.filter(|(_, bytes)| Incoming::open(bytes).is_err()).collect();
    golden.sort();
    golden
}

#[test]
fn python_reads_every_message_as_the_library_does() {
    let Some(mut script) = script() else { return };
    let golden = golden();
    assert!(golden.len() >= 15, "only {} golden messages", golden.len());
    let output = script.args(golden.iter().map(|(path, _)| path)).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().count(), golden.len());
    for (line, (path, bytes)) in text.lines().zip(&golden) {
        let python: Value = serde_json::from_str(line).unwrap();
        assert_eq!(python, object(bytes), "{}", path.display());
    }
}

#[test]
fn python_names_every_refusal_the_library_knows() {
    let Some(mut script) = script() else { return };
    let folder = std::env::temp_dir().join(format!("kehai-refusals-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    // The code is the third byte from the end, its detail the two behind it.
    let (_, refused) = golden().into_iter().find(|(path, _)| path.ends_with("refused-version.hex")).unwrap();
    let of_code = |code: u8| {
        let mut datagram = refused.clone();
        let at = datagram.len() - 3;
        datagram[at] = code;
        datagram
    };
    let known = |datagram: &Vec<u8>| match Message::decode(datagram).unwrap().1 {
        Message::Refused(refused) => !matches!(refused.refusal, Refusal::Unknown(_)),
        other => panic!("{other:?}"),
    };
    let datagrams: Vec<_> = (0..=u8::MAX).map(of_code).filter(known).collect();
    assert!(datagrams.len() >= 18);
    for (code, datagram) in datagrams.iter().enumerate() {
        let path = folder.join(code.to_string());
        std::fs::write(&path, datagram).unwrap();
        script.arg(path);
    }
    let output = script.output().unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let python: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let rust: Vec<Value> = datagrams.iter().map(|datagram| object(datagram)).collect();
    assert_eq!(python, rust);
}

#[test]
fn python_refuses_what_is_damaged_in_one_clear_line() {
    let Some(mut script) = script() else { return };
    let path = std::env::temp_dir().join(format!("kehai-wire-{}.bin", std::process::id()));
    let (_, report) = golden().into_iter().find(|(path, _)| path.ends_with("report.hex")).unwrap();
    std::fs::write(&path, &report[..report.len() - 1]).unwrap();
    let output = script.arg(&path).output().unwrap();
    std::fs::remove_file(&path).unwrap();
    assert!(!output.status.success());
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "kehai_wire.py: the message ends too soon\n");
}

#[test]
fn python_subscribes_and_prints_what_comes() {
    let Some(mut script) = script() else { return };
    let own = Identity { module: ModuleId([2, 0, 0, 0, 0, 1]), boot: 3 };
    let cookie = Cookie([1, 2, 3, 4, 5, 6, 7, 8]);
    let module = UdpSocket::bind("127.0.0.1:0").unwrap();
    module.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    let address = module.local_addr().unwrap().to_string();
    let mut host = script.args(["--listen", &address]).stdout(Stdio::piped()).spawn().unwrap();
    let mut room = [0; 2048];
    for expected in [Cookie::NONE, cookie] {
        let (length, from) = module.recv_from(&mut room).unwrap();
        let incoming = Incoming::open(&room[..length]).unwrap();
        assert_eq!(incoming.cookie, expected);
        let Ok(Request::Subscribe { t1 }) = incoming.request(own) else { panic!("no subscribe") };
        let answer = if expected == Cookie::NONE {
            Message::Cookie { request_id: incoming.request_id, t1, cookie }
        } else {
            Message::Done { request_id: 77 }
        };
        let mut out = [0; DATAGRAM_MAX];
        let length = answer.encode(own, &mut out).unwrap();
        module.send_to(&out[..length], from).unwrap();
    }
    let lines = BufReader::new(host.stdout.take().unwrap()).lines();
    let messages: Vec<Value> =
        lines.take(2).map(|line| serde_json::from_str(&line.unwrap()).unwrap()).collect();
    host.kill().unwrap();
    host.wait().unwrap();
    assert_eq!(messages[0]["cookie"], "0102030405060708");
    assert_eq!(
        messages[1],
        json!({"message": "done", "module": "02:00:00:00:00:01", "boot": 3, "request_id": 77})
    );
}

/// A datagram as the script prints it.
fn object(datagram: &[u8]) -> Value {
    let (header, message) = Message::decode(datagram).unwrap();
    let (name, content) = match message {
        Message::Refused(refused) => {
            let mut object = json!({"request_id": refused.request_id, "kind": refused.kind});
            match refused.refusal {
                Refusal::Version { min, max } => {
                    extend(
                        &mut object,
                        json!({"refusal": "version", "version_min": min, "version_max": max}),
                    );
                }
                Refusal::Image(fault) => {
                    extend(&mut object, json!({"refusal": "image", "fault": u8::from(fault)}));
                }
                Refusal::Setting { line, fault } => {
                    extend(
                        &mut object,
                        json!({"refusal": "setting", "line": line, "fault": u8::from(fault)}),
                    );
                }
                other => extend(&mut object, json!({"refusal": snake(other)})),
            }
            ("refused", object)
        }
        Message::Cookie { request_id, t1, cookie } => {
            ("cookie", json!({"request_id": request_id, "t1": hex(&t1), "cookie": hex(&cookie.0)}))
        }
        Message::Subscribed(it) => {
            let object = json!({"request_id": it.request_id, "t1": hex(&it.t1), "t2_us": it.t2_us, "t3_us": it.t3_us,
                "lease_ms": it.lease_ms, "may_control": it.may_control, "subscribers": it.subscribers});
            ("subscribed", object)
        }
        Message::Info(it) => ("info", info(&it)),
        Message::Done { request_id } => ("done", json!({"request_id": request_id})),
        Message::Settings { request_id, text } => {
            ("settings", json!({"request_id": request_id, "text": text}))
        }
        Message::Absorbed { request_id, beams, background_version } => {
            let object =
                json!({"request_id": request_id, "beams": beams, "background_version": background_version});
            ("absorbed", object)
        }
        Message::Receiving { request_id, next } => {
            ("receiving", json!({"request_id": request_id, "next": next}))
        }
        Message::Report(it) => ("report", report(&it)),
        Message::Health(it) => ("health", health(&it)),
        Message::ProfilePart(it) => {
            let mut object = part_head(&it.head);
            let beams: Vec<Value> = it
                .beams
                .iter()
                .map(|beam| {
                    json!({"far_mm": beam.far_mm,
                "near_mm": beam.near_mm, "spread_mm": beam.spread_mm, "state": snake(beam.state)})
                })
                .collect();
            extend(&mut object, json!({"beams": beams}));
            ("profile_part", object)
        }
        Message::RawPart(it) => {
            let mut object = part_head(&it.head);
            let ranges_mm: Vec<u16> = it.ranges_mm.iter().collect();
            extend(
                &mut object,
                json!({"stamp_us": it.time.stamp_us, "sensor_ms": it.time.sensor_ms,
                "uncertainty_us": it.time.uncertainty_us, "ranges_mm": ranges_mm}),
            );
            ("raw_part", object)
        }
        Message::Pressed(it) => ("pressed", pressed(&it)),
    };
    let mut object =
        json!({"message": name, "module": header.identity.module.to_string(), "boot": header.identity.boot});
    extend(&mut object, content);
    object
}

fn report(report: &Report<'_>) -> Value {
    let head = &report.head;
    let candidates: Vec<Value> = report.candidates.iter().map(|one| candidate(&one)).collect();
    let unseen: Vec<Value> = report.unseen.iter().map(|span| unseen_span(&span)).collect();
    let size = |one: Size| json!({"volume_l": one.volume_l, "top_cm": one.top_cm});
    let sizes: Vec<Value> =
        report.sizes.iter().map(|one| if one.is_known() { size(one) } else { Value::Null }).collect();
    json!({"sequence": head.sequence, "setup": head.setup, "background_version": head.background_version,
        "stamp_us": head.stamp_us, "sensor_ms": head.sensor_ms, "uncertainty_us": head.uncertainty_us,
        "lost_scans": head.lost_scans, "candidates": candidates, "unseen": unseen, "sizes": sizes})
}

fn pressed(pressed: &Pressed<'_>) -> Value {
    let head = &pressed.head;
    let bits: Vec<u8> = pressed.down.iter().collect();
    let panels = usize::from(pressed.columns) * usize::from(pressed.rows);
    let down: Vec<usize> = (0..panels).filter(|panel| bits[panel / 8] >> (panel % 8) & 1 != 0).collect();
    let faulty: Vec<Value> =
        pressed.faulty.iter().map(|one| json!({"panel": one.panel, "fault": snake(one.fault)})).collect();
    json!({"sequence": head.sequence, "setup": head.setup, "background_version": head.background_version,
        "stamp_us": head.stamp_us, "sensor_ms": head.sensor_ms, "uncertainty_us": head.uncertainty_us,
        "lost_scans": head.lost_scans, "columns": pressed.columns, "rows": pressed.rows, "down": down,
        "faulty": faulty})
}

fn candidate(one: &Candidate) -> Value {
    let beyond_mm = |step_mm: i16| (step_mm != i16::MAX).then_some(step_mm);
    let contour_mm: Vec<Option<u16>> = (0..one.contour.len()).map(|point| one.contour_mm(point)).collect();
    let necks: Vec<Value> =
        one.necks.iter().map(|neck| json!({"step": neck.step, "depth_mm": neck.depth_mm})).collect();
    json!({"first_step": one.first_step, "last_step": one.last_step, "near_step": one.near_step,
        "beams": one.beams, "first_mm": one.first_mm, "mid_mm": one.mid_mm, "last_mm": one.last_mm,
        "near_mm": one.near_mm, "static_ds": one.static_ds, "first_end": snake(one.first_end.kind),
        "last_end": snake(one.last_end.kind), "first_beyond_mm": beyond_mm(one.first_end.step_mm),
        "last_beyond_mm": beyond_mm(one.last_end.step_mm), "touches": one.touches, "narrow": one.narrow,
        "contour_mm": contour_mm, "necks": necks})
}

fn unseen_span(span: &UnseenSpan) -> Value {
    json!({"first_step": span.first_step, "beams": span.beams, "near_mm": span.near_mm, "reason": snake(span.reason)})
}

fn health(health: &Health<'_>) -> Value {
    let head = &health.head;
    let learning = head.learning.map(|LearningProgress { scans, of, restarts, moved }| {
        json!({"scans": scans, "of": of, "restarts": restarts, "moved": moved})
    });
    let on = Alarms::NAMES.iter().filter(|(alarm, _)| head.alarms.has(*alarm));
    let alarms: Vec<&str> = on.map(|(_, name)| *name).collect();
    let counters: Map<String, Value> = Counter::ALL
        .iter()
        .map(|&counter| (counter.name().into(), health.counters.get(counter).into()))
        .collect();
    let suspects: Vec<Value> = health
        .suspects
        .iter()
        .map(|it| json!({"first_step": it.first_step, "last_step": it.last_step, "near_mm": it.near_mm}))
        .collect();
    let events: Vec<Value> = health.events.iter().map(|Event { number, at_us, kind, background_version, by }| {
        json!({"number": number, "at_us": at_us, "kind": snake(kind), "background_version": background_version,
            "by": std::net::Ipv4Addr::from(by).to_string()})
    }).collect();
    json!({"uptime_us": head.uptime_us, "sequence": head.sequence, "setup": head.setup,
        "background_version": head.background_version, "sensor": snake(head.sensor.code), "sensor_detail": head.sensor.detail, "alarms": alarms,
        "storing": head.storing, "subscribers": head.subscribers, "learning": learning, "counters": counters,
        "suspects": suspects, "events": events})
}

fn info(info: &Info<'_>) -> Value {
    let sensor = |it: SensorInfo<'_>| {
        json!({"model": it.model, "serial": it.serial, "firmware": it.firmware, "first_step": it.first_step,
            "last_step": it.last_step, "cluster": it.cluster, "front_step": it.front_step,
            "steps_per_turn": it.steps_per_turn, "period_us": it.period_us, "range_min_mm": it.range_min_mm,
            "range_max_mm": it.range_max_mm, "skip": it.skip, "open_range_mm": it.open_range_mm})
    };
    json!({"request_id": info.request_id, "version_min": info.version_min, "version_max": info.version_max,
        "firmware": info.firmware, "build": info.build, "board": info.board, "name": info.name,
        "uptime_us": info.uptime_us, "setup": info.setup, "background_version": info.background_version,
        "sensor": info.sensor.map(sensor)})
}

fn part_head(head: &PartHead) -> Value {
    json!({"object": head.object, "part": head.part, "parts": head.parts, "first_step": head.first_step,
        "setup": head.setup})
}

fn extend(object: &mut Value, more: Value) {
    let (Value::Object(object), Value::Object(more)) = (object, more) else { panic!("not objects") };
    object.extend(more);
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The name of a variant as the script writes it: `TooShort` is `too_short`.
fn snake(variant: impl std::fmt::Debug) -> String {
    let mut name = String::new();
    for character in format!("{variant:?}").chars() {
        if character.is_uppercase() && !name.is_empty() {
            name.push('_');
        }
        name.extend(character.to_lowercase());
    }
    name
}
