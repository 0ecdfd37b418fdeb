//! One counter for everything a module drops, refuses or has to do again.
//!
//! Their order is the order on the wire: new ones come last, so that any two versions understand
//! each other's. Names are also in `docs/wire.md` and `examples/python/kehai_wire.py`.

use super::codec::{Item, List, Malformed, Reader, TooLong, VARINT_U32, Writer};
use crate::pipeline;
use crate::scip::Losses;
use crate::sensor::SensorCounters;

macro_rules! counters {
    ($($(#[$doc:meta])* $variant:ident = $name:literal;)*) => {
        /// What is counted.
        #[derive(Clone, Copy, PartialEq, Eq, Debug)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub enum Counter {
            $($(#[$doc])* $variant,)*
        }

        impl Counter {
            /// All, in their order.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// Its name, for people and programs.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}

counters! {
    /// Scans lost before they could be reported, whatever the cause.
    LostScans = "lost_scans";
    /// Scans handed on by the sensor's driver.
    ScansAccepted = "scans_accepted";
    /// Scans missing between those, by the sensor's stamps.
    ScansMissing = "scans_missing";
    /// Scans dropped because they arrived damaged.
    ScansDamaged = "scans_damaged";
    /// Scans dropped because they had the stamp of the one before.
    ScansRepeated = "scans_repeated";
    /// Scans the sensor itself left out as unstable.
    ScansUnstable = "scans_unstable";
    /// Times the sensor's stream fell silent.
    SensorStalls = "sensor_stalls";
    /// Times the stream was asked to go on without a full start.
    SensorResumes = "sensor_resumes";
    /// Times a sensor was found and set up.
    SensorStarts = "sensor_starts";
    /// Times the sensor's clock started anew.
    SensorClockRestarts = "sensor_clock_restarts";
    /// Resets and reboots of the sensor.
    SensorReboots = "sensor_reboots";
    /// Times the speed of the sensor's line was raised.
    SensorBaudChanges = "sensor_baud_changes";
    /// Requests the sensor refused.
    SensorRefusals = "sensor_refusals";
    /// Requests the sensor did not answer in time.
    SensorTimeouts = "sensor_timeouts";
    /// Reads and writes of the sensor's line that failed.
    SensorLinkFailures = "sensor_link_failures";
    /// Sensor replies dropped: wrong checksum.
    SensorChecksum = "sensor_checksum";
    /// Sensor replies dropped: a character outside the code.
    SensorCharacter = "sensor_character";
    /// Sensor replies dropped: a line too long or too short.
    SensorLineLength = "sensor_line_length";
    /// Sensor replies dropped: more or fewer values than asked for.
    SensorValueCount = "sensor_value_count";
    /// Sensor replies dropped: a scan larger than its buffer.
    SensorBufferTooShort = "sensor_buffer_too_short";
    /// Sensor bytes dropped: neither an expected echo nor a reply.
    SensorEcho = "sensor_echo";
    /// Sensor replies dropped: no status behind the echo.
    SensorStatus = "sensor_status";
    /// Sensor replies dropped: another one began in the middle.
    SensorForeignReply = "sensor_foreign_reply";
    /// Sensor replies dropped: a parameter is missing.
    SensorParameters = "sensor_parameters";
    /// Lines of sensor replies dropped: malformed.
    SensorInfoLine = "sensor_info_line";
    /// Whole sensor replies to nothing that was asked.
    SensorUnexpected = "sensor_unexpected";
    /// Scans of another geometry than the pipeline was set up for.
    ForeignScans = "foreign_scans";
    /// Scans with fewer beams than the geometry has.
    ShortScans = "short_scans";
    /// Candidates that became unseen spans for lack of room.
    CandidatesOver = "candidates_over";
    /// Unseen spans merged for lack of room.
    SpansMerged = "spans_merged";
    /// Reports that could not be queued at once, one for every subscriber that missed one.
    ReportsDropped = "reports_dropped";
    /// Health messages that could not be queued at once.
    HealthDropped = "health_dropped";
    /// Parts of profiles and raw scans that could not be queued at once.
    PartsDropped = "parts_dropped";
    /// Answers that could not be queued at once.
    AnswersDropped = "answers_dropped";
    /// Times a stuck socket for reports or answers was opened anew.
    SocketsReopened = "sockets_reopened";
    /// Datagrams dropped: not of this protocol.
    DatagramsForeign = "datagrams_foreign";
    /// Datagrams dropped: shorter than their fixed part.
    DatagramsTooShort = "datagrams_too_short";
    /// Datagrams dropped: longer than any may be.
    DatagramsTooLong = "datagrams_too_long";
    /// Datagrams dropped: a module's message.
    DatagramsWrongDirection = "datagrams_wrong_direction";
    /// Cookies given to hosts without one.
    CookiesGiven = "cookies_given";
    /// Subscribers forgotten because they did not renew.
    SubscribersForgotten = "subscribers_forgotten";
    /// Requests that came again and got their stored answer.
    RequestsRepeated = "requests_repeated";
    /// Requests refused: [`Version`](super::Refusal::Version).
    RefusedVersion = "refused_version";
    /// Requests refused: [`Unsupported`](super::Refusal::Unsupported).
    RefusedUnsupported = "refused_unsupported";
    /// Requests refused: [`Malformed`](super::Refusal::Malformed).
    RefusedMalformed = "refused_malformed";
    /// Requests refused: [`BadCookie`](super::Refusal::BadCookie).
    RefusedBadCookie = "refused_bad_cookie";
    /// Requests refused: [`Full`](super::Refusal::Full).
    RefusedFull = "refused_full";
    /// Requests refused: [`WrongModule`](super::Refusal::WrongModule).
    RefusedWrongModule = "refused_wrong_module";
    /// Requests refused: [`WrongBoot`](super::Refusal::WrongBoot).
    RefusedWrongBoot = "refused_wrong_boot";
    /// Requests refused: [`NotAllowed`](super::Refusal::NotAllowed).
    RefusedNotAllowed = "refused_not_allowed";
    /// Requests refused: [`Superseded`](super::Refusal::Superseded).
    RefusedSuperseded = "refused_superseded";
    /// Wishes to absorb that the pipeline refused.
    RefusedAbsorb = "refused_absorb";
    /// Wishes to learn that the pipeline refused.
    RefusedLearn = "refused_learn";
    /// Requests refused: [`Busy`](super::Refusal::Busy).
    RefusedBusy = "refused_busy";
    /// Settings refused: [`Setting`](super::Refusal::Setting).
    RefusedSetting = "refused_setting";
    /// Times settings, background or the count of starts could not be stored.
    StoreFailures = "store_failures";
    /// Starts caused by the watchdog.
    WatchdogResets = "watchdog_resets";
    /// Times the network link went down.
    LinkLosses = "link_losses";
    /// Datagrams for the module that its network stack had no room for, or found damaged.
    DatagramsDropped = "datagrams_dropped";
    /// Datagrams of the service discovery that were dropped, in either direction.
    DiscoveryDropped = "discovery_dropped";
    /// Sessions opened by the holder of a key.
    SessionsOpened = "sessions_opened";
    /// Wishes for a session dropped: not made by the holder of the key they name.
    OpenForged = "open_forged";
    /// Wishes for a session dropped: they have opened one already.
    OpenReplayed = "open_replayed";
    /// Sealed datagrams dropped: of no session with their sender.
    SealedUnknown = "sealed_unknown";
    /// Sealed datagrams dropped: their counter was taken before.
    SealedReplayed = "sealed_replayed";
    /// Sealed datagrams dropped: not made by the holder of the session's key, or changed on the way.
    SealedForged = "sealed_forged";
    /// Requests refused: [`NeedsKey`](super::Refusal::NeedsKey) or [`NoSuchKey`](super::Refusal::NoSuchKey).
    RefusedKey = "refused_key";
    /// Requests refused: [`Image`](super::Refusal::Image).
    RefusedImage = "refused_image";
}

/// Number of [`Counter`]s.
pub const COUNTERS: usize = Counter::ALL.len();

/// All counters since the module started. They stop at their largest value.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters([u32; COUNTERS]);

impl Counters {
    /// All 0.
    #[must_use]
    pub const fn new() -> Self {
        Self([0; COUNTERS])
    }

    /// One more.
    pub fn count(&mut self, counter: Counter) {
        let value = self.get(counter);
        self.set(counter, value.saturating_add(1));
    }

    /// Sets a counter to a count kept elsewhere.
    pub fn set(&mut self, counter: Counter, value: u32) {
        if let Some(slot) = self.0.get_mut(counter as usize) {
            *slot = value;
        }
    }

    /// Takes over what the SCIP reader has counted.
    pub fn set_reader(&mut self, counted: &Losses) {
        let Losses {
            checksum,
            character,
            line_length,
            value_count,
            buffer_too_short,
            echo,
            status,
            foreign_reply,
            parameters,
            info_line,
            unexpected,
            scans,
        } = *counted;
        self.set_all(&[
            (Counter::SensorChecksum, checksum),
            (Counter::SensorCharacter, character),
            (Counter::SensorLineLength, line_length),
            (Counter::SensorValueCount, value_count),
            (Counter::SensorBufferTooShort, buffer_too_short),
            (Counter::SensorEcho, echo),
            (Counter::SensorStatus, status),
            (Counter::SensorForeignReply, foreign_reply),
            (Counter::SensorParameters, parameters),
            (Counter::SensorInfoLine, info_line),
            (Counter::SensorUnexpected, unexpected),
            (Counter::ScansDamaged, scans),
        ]);
    }

    /// Takes over what the sensor's driver has counted.
    pub fn set_sensor(&mut self, counted: &SensorCounters) {
        let SensorCounters {
            scans_accepted,
            scans_missing,
            scans_repeated,
            scans_unstable,
            stalls,
            resumes,
            starts,
            clock_restarts,
            reboots,
            baud_changes,
            refusals,
            timeouts,
            link_failures,
        } = *counted;
        self.set_all(&[
            (Counter::ScansAccepted, scans_accepted),
            (Counter::ScansMissing, scans_missing),
            (Counter::ScansRepeated, scans_repeated),
            (Counter::ScansUnstable, scans_unstable),
            (Counter::SensorStalls, stalls),
            (Counter::SensorResumes, resumes),
            (Counter::SensorStarts, starts),
            (Counter::SensorClockRestarts, clock_restarts),
            (Counter::SensorReboots, reboots),
            (Counter::SensorBaudChanges, baud_changes),
            (Counter::SensorRefusals, refusals),
            (Counter::SensorTimeouts, timeouts),
            (Counter::SensorLinkFailures, link_failures),
        ]);
    }

    /// Takes over what the pipeline has counted. Wishes to absorb that it refused are counted where the
    /// refusal is sent.
    pub fn set_pipeline(&mut self, counted: &pipeline::Counters) {
        let pipeline::Counters {
            foreign_scans,
            short_scans,
            candidates_over,
            spans_merged,
            absorbs_refused: _,
        } = *counted;
        self.set_all(&[
            (Counter::ForeignScans, foreign_scans),
            (Counter::ShortScans, short_scans),
            (Counter::CandidatesOver, candidates_over),
            (Counter::SpansMerged, spans_merged),
        ]);
    }

    fn set_all(&mut self, values: &[(Counter, u32)]) {
        values.iter().for_each(|&(counter, value)| self.set(counter, value));
    }

    /// The value of one.
    #[must_use]
    pub fn get(&self, counter: Counter) -> u32 {
        self.0.get(counter as usize).copied().unwrap_or(0)
    }

    /// All of them as sent.
    pub(super) const fn list(&self) -> List<'_, u32> {
        List::new(&self.0)
    }

    /// As many as both sides know.
    pub(super) fn of_list(list: List<'_, u32>) -> Self {
        let mut counters = Self::new();
        counters.0.iter_mut().zip(list.iter()).for_each(|(slot, value)| *slot = value);
        counters
    }
}

impl Default for Counters {
    fn default() -> Self {
        Self::new()
    }
}

/// A counter: most are small, so a varint.
impl Item for u32 {
    const MAX: usize = VARINT_U32;

    fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put(self)
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        reader.required()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_stops_at_its_largest_value() {
        let mut counters = Counters::new();
        counters.count(Counter::LinkLosses);
        assert_eq!(counters.get(Counter::LinkLosses), 1);
        counters.set(Counter::LinkLosses, u32::MAX);
        counters.count(Counter::LinkLosses);
        assert_eq!(counters.get(Counter::LinkLosses), u32::MAX);
    }

    #[test]
    fn what_others_have_counted_is_taken_over() {
        let mut counters = Counters::new();
        let pipeline =
            pipeline::Counters { foreign_scans: 1, short_scans: 2, candidates_over: 3, ..Default::default() };
        counters.set_pipeline(&pipeline);
        counters.set_sensor(&SensorCounters { link_failures: 5, scans_missing: 6, ..Default::default() });
        counters.set_reader(&Losses { scans: 7, echo: 8, ..Default::default() });
        let some = [
            (Counter::ForeignScans, 1),
            (Counter::ShortScans, 2),
            (Counter::CandidatesOver, 3),
            (Counter::SensorLinkFailures, 5),
            (Counter::ScansMissing, 6),
            (Counter::ScansDamaged, 7),
            (Counter::SensorEcho, 8),
        ];
        for counter in Counter::ALL {
            let expected = some.iter().find(|(which, _)| which == counter).map_or(0, |(_, value)| *value);
            assert_eq!(counters.get(*counter), expected, "{}", counter.name());
        }
    }
}
