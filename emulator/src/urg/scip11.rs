//! SCIP 1.1, in which a classic URG-04LX wakes up: single letters, one status character, no checksums.
//!
//! ```text
//! V           ─▶  V LF 0 LF lines LF
//! G00076801   ─▶  G00076801 LF 0 LF lines of 64 characters LF      two characters a value, no stamp
//! S0576000000000 ─▶  echo LF 0 LF LF                               bit rate, 7 digits reserved
//! SCIP2.0     ─▶  SCIP2.0 LF 0 LF LF
//! other       ─▶  echo LF E LF LF
//! ```

use super::Urg;
use super::commands::RATES;
use super::encode::LINE_CHARACTERS;
use super::measurement::characters;
use super::request::{Coding, Measurement, number};
use super::texts;
use crate::source::Revolution;

/// Digits of `S` after the rate.
const RESERVED_DIGITS: usize = 7;

impl Urg {
    /// Answers a request in SCIP 1.1.
    pub(super) fn execute_scip11(&mut self, request: &[u8]) {
        match request {
            b"SCIP2.0" => {
                self.reply_scip11(request, b'0', &[]);
                self.mode.scip11 = false;
            }
            b"V" => {
                let lines = texts::version_scip11(&self.config.model);
                self.reply_scip11(request, b'0', &lines);
            }
            b"L0" | b"L1" => {
                self.mode.laser = request == b"L1";
                self.reply_scip11(request, b'0', &[]);
            }
            [b'G', rest @ ..] => match self.scan_scip11(rest) {
                Some(lines) => self.reply_scip11(request, b'0', &lines),
                None => self.reply_scip11(request, b'E', &[]),
            },
            [b'S', rest @ ..] if rest.len() == 6 + RESERVED_DIGITS => {
                let rate = rest.get(..6).and_then(number).filter(|rate| RATES.contains(rate));
                let status = if rate.is_some() { b'0' } else { b'E' };
                self.reply_scip11(request, status, &[]);
                if let Some(rate) = rate {
                    self.change_baud(rate);
                }
            }
            _ => self.reply_scip11(request, b'E', &[]),
        }
    }

    fn reply_scip11(&mut self, request: &[u8], status: u8, lines: &[u8]) {
        self.counts.refusals += u64::from(status != b'0');
        let mut reply = [request, b"\n", &[status], b"\n", lines].concat();
        reply.push(b'\n');
        self.send(reply);
    }

    /// The data lines of `Gsssecc`: three digits first step, three last, two cluster.
    fn scan_scip11(&mut self, digits: &[u8]) -> Option<Vec<u8>> {
        let field = |from: usize, to: usize| digits.get(from..to).and_then(number);
        let (first, last, cluster) = (field(0, 3)?, field(3, 6)?, field(6, 8)?);
        if digits.len() != 8 || first > last || last > u32::from(self.config.model.max_step) {
            return None;
        }
        let asked = Measurement {
            running: false,
            multi_echo: false,
            coding: Coding::Two,
            first_step: first as u16,
            last_step: last as u16,
            cluster: cluster.max(1) as u16,
            skip: 0,
            scans: 1,
        };
        let scan = self.source.latest(Revolution {
            start_us: self.mirror.complete_us(self.now_us),
            period_us: self.mirror.period_us(),
            earliest_us: 0,
        })?;
        let values = characters(&self.config.model, &asked, &scan.ranges_mm);
        let mut lines = Vec::new();
        for line in values.chunks(LINE_CHARACTERS) {
            lines.extend_from_slice(line);
            lines.push(b'\n');
        }
        Some(lines)
    }
}
