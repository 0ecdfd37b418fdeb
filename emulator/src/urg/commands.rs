//! SCIP 2.0 and 2.2: what each request does, and how it is refused.
//!
//! ```text
//! request LF ─▶ echo LF status sum LF [lines] LF
//! ```
//!
//! | refusal | SCIP 2.0 | SCIP 2.2 |
//! |---|---|---|
//! | 0B | a second request of a kind before the first is answered | same |
//! | 0C, 0D | too short, too long | same |
//! | 0E | unknown, or not now (time-sync state) | |
//! | 0F | | unknown |
//! | 0G, 0H | string after `;` too long, of wrong characters | same |
//! | 0L | | out of order: only `VV`, `II`, `RB` |
//! | 01, 50 | out of order: `BM`, measurements | |
//! | 10 | laser is off (`G`) | not now |

use super::encode::{push_line, push_stamp};
use super::mode::FAULTY;
use super::model::{Family, Interface, QuitInTimeSync, WhileBooting};
use super::power::Power;
use super::request::{Coding, Measurement, measurement_kind, number, split_string, string_refusal};
use super::{Urg, texts};
use crate::source::Revolution;

/// Bit rates a sensor can be set to.
pub(super) const RATES: [u32; 6] = [19_200, 57_600, 115_200, 250_000, 500_000, 750_000];

/// Answer to a request: its status and what follows it.
type Answer = (&'static str, Vec<u8>);

fn plain(status: &'static str) -> Answer {
    (status, Vec::new())
}

/// 00 if the length is right, else the refusal of what is missing or too much.
fn length_refusal(command: &[u8], wanted: usize) -> Option<&'static str> {
    match command.len().cmp(&wanted) {
        std::cmp::Ordering::Less => Some("0C"),
        std::cmp::Ordering::Equal => None,
        std::cmp::Ordering::Greater => Some("0D"),
    }
}

impl Urg {
    /// Answers one request. `repeated`: another of its kind came before it in the same go.
    pub(super) fn execute(&mut self, request: &[u8], repeated: bool) {
        if self.mode.scip11 {
            self.execute_scip11(request);
            return;
        }
        let (command, string) = split_string(request);
        if self.faults.ignores(command) {
            return;
        }
        if self.faults.wedges(command) {
            self.mode.wedged = true;
            return;
        }
        if self.faults.busy_time(command) {
            self.send_status(request, "10");
            return;
        }
        let (status, lines) = if repeated {
            plain("0B")
        } else if let Some(status) = string.and_then(string_refusal) {
            plain(status)
        } else {
            self.run(command, request)
        };
        self.counts.refusals += u64::from(!matches!(status, "00" | "99"));
        if status == SILENT {
            return;
        }
        let mut reply = request.to_vec();
        reply.push(b'\n');
        push_line(&mut reply, status.as_bytes());
        reply.extend_from_slice(&lines);
        reply.push(b'\n');
        self.send(reply);
        self.after_reply(command, status);
    }

    /// What may only happen once the answer has been sent.
    fn after_reply(&mut self, command: &[u8], status: &str) {
        if status != "00" {
            return;
        }
        if let Some(rate) = command.strip_prefix(b"SS").and_then(number) {
            self.change_baud(rate);
        } else if command == b"RS" {
            self.change_baud(self.config.model.power_up_baud);
        }
    }

    /// The line changes its speed when everything queued has been sent at the old one.
    pub(super) fn change_baud(&mut self, baud: u32) {
        if self.config.paced {
            self.port.change_baud_later(baud, self.now_us);
        } else {
            self.port.baud = baud;
        }
    }

    fn unknown(&self) -> &'static str {
        if self.config.model.family == Family::Ust { "0F" } else { "0E" }
    }

    fn not_now(&self) -> &'static str {
        if self.config.model.family == Family::Ust { "10" } else { "0E" }
    }

    /// Why the sensor's state forbids a request.
    fn forbidden(&self, command: &[u8]) -> Option<&'static str> {
        let kind = command.get(..2).unwrap_or(command);
        if matches!(kind, b"VV" | b"II") {
            return None;
        }
        if self.mode.abnormal {
            return (kind != b"RB").then_some("0L");
        }
        if self.supply.power != Power::On && self.config.model.while_booting == WhileBooting::Accepts {
            return (kind == b"TM" && !self.mode.asked_while_booting).then_some("10");
        }
        if self.supply.power != Power::On {
            return match kind {
                b"PP" | b"QT" => None,
                b"%S" => None,
                b"BM" => Some("01"),
                _ => Some("10"),
            };
        }
        let ust = self.config.model.family == Family::Ust;
        if self.mode.time_sync {
            let allowed = match kind {
                b"TM" | b"RS" | b"RT" | b"RB" => true,
                b"QT" => self.config.model.quit_in_time_sync == QuitInTimeSync::Leaves,
                b"%S" => ust,
                _ => false,
            };
            return (!allowed).then(|| self.not_now());
        }
        if self.mode.asleep {
            return (!matches!(kind, b"QT" | b"RS" | b"RT" | b"RB" | b"%S")).then_some("10");
        }
        None
    }

    fn run(&mut self, command: &[u8], request: &[u8]) -> Answer {
        if let Some(status) = self.forbidden(command) {
            return plain(status);
        }
        let model = self.config.model;
        let ust = model.family == Family::Ust;
        if let [first, second, ..] = command
            && let Some((running, multi_echo, coding)) = measurement_kind([*first, *second])
        {
            let supported = match model.family {
                Family::Classic => !multi_echo && coding != Coding::WithIntensity,
                Family::TopUrg => !multi_echo,
                Family::Ust => true,
            };
            return if !supported {
                plain(self.unknown())
            } else if running {
                self.measure(command, request)
            } else {
                self.get(command)
            };
        }
        let kind = command.get(..2).unwrap_or(command);
        let wanted = match kind {
            b"VV" | b"PP" | b"II" | b"BM" | b"QT" | b"RS" | b"RT" => 2,
            b"RB" if model.reboots() => 2,
            b"TM" | b"HS" => 3,
            b"%S" if ust => 3,
            b"CR" | b"DB" => 4,
            b"SS" if model.interface != Interface::Ethernet => 8,
            _ => return plain(if command == b"SCIP2.0" { "0E" } else { self.unknown() }),
        };
        if let Some(status) = length_refusal(command, wanted) {
            return plain(status);
        }
        let argument = command.get(2..).unwrap_or_default();
        match kind {
            b"VV" => ("00", self.faults.damage_version(texts::version(&model))),
            b"PP" => ("00", texts::parameters(&model)),
            b"II" => ("00", texts::state(&model, &self.situation())),
            b"BM" => plain(self.laser_on()),
            b"QT" => plain(self.quit()),
            b"RS" => plain(self.reset(true)),
            b"RT" => plain(self.reset(false)),
            b"RB" => plain(self.reboot()),
            b"TM" => self.time(argument),
            b"SS" => plain(self.bit_rate(argument)),
            b"CR" => plain(self.motor_speed(argument)),
            b"HS" => plain(self.sensitivity(argument)),
            b"DB" => plain(self.fault_drill(argument)),
            _ => self.state_or_sleep(argument),
        }
    }

    fn laser_on(&mut self) -> &'static str {
        if self.mode.drill == Some(FAULTY) {
            "01"
        } else if std::mem::replace(&mut self.mode.laser, true) {
            "02"
        } else {
            "00"
        }
    }

    fn quit(&mut self) -> &'static str {
        self.stop_measuring();
        self.mode.time_sync = false;
        self.mode.asleep = false;
        "00"
    }

    fn reset(&mut self, motor_too: bool) -> &'static str {
        self.stop_measuring();
        self.mode.asleep = false;
        self.mode.high_sensitivity = false;
        self.mode.drill = None;
        self.clock.reset(self.now_us);
        if motor_too && self.mode.speed_level != 0 {
            self.mode.speed_level = 0;
            self.mirror = self.new_mirror();
        }
        "00"
    }

    fn reboot(&mut self) -> &'static str {
        if !self.supply.ask_reboot(self.now_us) {
            return "01";
        }
        self.stop_measuring();
        if self.faults.silent_reboot() { SILENT } else { "00" }
    }

    fn time(&mut self, argument: &[u8]) -> Answer {
        match argument {
            b"0" if self.mode.time_sync => plain("02"),
            b"0" if self.output.stream.is_some() => plain("10"),
            b"0" => {
                self.mode.laser = false;
                self.mode.time_sync = true;
                plain("00")
            }
            b"1" if !self.mode.time_sync => plain("04"),
            b"1" => {
                let mut lines = Vec::new();
                push_stamp(&mut lines, self.clock.stamp_ms(self.now_us));
                ("00", lines)
            }
            b"2" if !self.mode.time_sync => plain("03"),
            b"2" => {
                self.mode.time_sync = false;
                plain("00")
            }
            _ => plain("01"),
        }
    }

    fn bit_rate(&mut self, argument: &[u8]) -> &'static str {
        match number(argument) {
            None => "01",
            Some(rate) if !RATES.contains(&rate) => "02",
            Some(rate) if rate == self.port.baud => "03",
            Some(_) => "00",
        }
    }

    fn motor_speed(&mut self, argument: &[u8]) -> &'static str {
        if self.config.model.family != Family::Classic {
            return "04";
        }
        let Some(level) = number(argument) else { return "01" };
        let level = match level {
            99 => 0,
            0..=10 if level == u32::from(self.mode.speed_level) => return "03",
            0..=10 => level as u8,
            _ => return "02",
        };
        self.mode.speed_level = level;
        self.mirror = self.new_mirror();
        "00"
    }

    fn sensitivity(&mut self, argument: &[u8]) -> &'static str {
        if self.config.model.family != Family::Classic {
            return "03";
        }
        let high = match argument {
            b"0" => false,
            b"1" => true,
            _ => return "01",
        };
        if std::mem::replace(&mut self.mode.high_sensitivity, high) == high { "02" } else { "00" }
    }

    fn fault_drill(&mut self, argument: &[u8]) -> &'static str {
        if self.config.model.family != Family::Classic {
            return self.unknown();
        }
        let Some(drill) = number(argument) else { return "01" };
        match drill {
            10 => self.mode.drill = None,
            _ if self.mode.drill == Some(FAULTY) => return "05",
            2 => {
                self.stop_measuring();
                self.mode.drill = Some(FAULTY);
            }
            3..=5 => self.mode.drill = Some(drill as u8),
            _ => return "02",
        }
        "00"
    }

    /// `%ST` and `%SL`.
    fn state_or_sleep(&mut self, argument: &[u8]) -> Answer {
        match argument {
            b"T" => {
                let state = match self.state() {
                    super::State::Booting => "001",
                    super::State::TimeSync => "002",
                    super::State::Streaming => "004",
                    super::State::Asleep => "005",
                    super::State::Abnormal => "900",
                    _ => "000",
                };
                let mut lines = Vec::new();
                push_line(&mut lines, state.as_bytes());
                ("00", lines)
            }
            b"L" => {
                self.stop_measuring();
                self.mode.asleep = true;
                // A slow sensor holds everything back behind this answer.
                self.port.transmitter.pause(self.now_us, self.faults.sleep_delay_us());
                plain("00")
            }
            _ => plain(self.unknown()),
        }
    }

    fn measure(&mut self, command: &[u8], request: &[u8]) -> Answer {
        if self.mode.drill == Some(FAULTY) {
            return plain("50");
        }
        match Measurement::parse(command, self.config.model.max_step) {
            Err(status) => plain(status),
            Ok(asked) => {
                self.start_measuring(asked, request);
                self.mode.asked_while_booting |= self.supply.power != Power::On;
                plain("00")
            }
        }
    }

    fn get(&mut self, command: &[u8]) -> Answer {
        // A UST looks at its laser first, other sensors at the request.
        if !self.mode.laser && self.config.model.family == Family::Ust {
            return plain("10");
        }
        let asked = match Measurement::parse(command, self.config.model.max_step) {
            Err(status) => return plain(status),
            Ok(_) if self.mode.drill == Some(FAULTY) => return plain("50"),
            Ok(_) if !self.mode.laser => return plain("10"),
            Ok(asked) => asked,
        };
        let start_us = self.mirror.complete_us(self.now_us);
        let revolution = Revolution { start_us, period_us: self.mirror.period_us(), earliest_us: 0 };
        let Some(scan) = self.source.latest(revolution) else { return plain("0A") };
        let mut lines = Vec::new();
        self.push_data(&mut lines, &asked, self.clock.stamp_ms(scan.start_us), &scan.ranges_mm);
        // The empty line at the end of the data is the one every reply ends with.
        lines.pop();
        ("00", lines)
    }
}

/// Stands for "no answer at all".
const SILENT: &str = "";
