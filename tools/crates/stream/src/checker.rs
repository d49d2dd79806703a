//! Whether a stream is all right: complete, in order, and with the reports that its frames deserve.

use common_sys::constants as c;
use common_sys::link::{Report, report_decode, report_encode, stream_pattern_first};
use common_sys::vision::{HEIGHT, WIDTH, detect, halve};

use crate::{Frame, Record, StreamHeader};

/// Problems that are described; more are only counted.
const DESCRIBED: usize = 20;

/// What was found. Everything but [`Findings::lost`], which only says that the receiver was slow, and
/// [`Findings::unsettled`], which says that the light has changed, should be 0.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Findings {
    /// Streams seen.
    pub sessions: u32,
    /// Pairs that are there, both eyes.
    pub pairs: u64,
    /// Pairs whose numbers are missing.
    pub lost: u64,
    /// End records whose counts are not those of the receiver.
    pub counts_differ: u32,
    /// Streams without an end record.
    pub unended: u32,
    /// Records out of order, eyes without their other, frames of impossible sizes.
    pub disorder: u64,
    /// Reports that were computed again.
    pub reports: u64,
    /// Of them, those that came out differently.
    pub reports_differ: u64,
    /// Pairs in which a camera's exposure was unsettled, as their reports say.
    pub unsettled: u64,
    /// Frames of the test pattern with a wrong pixel.
    pub pattern_wrong: u64,
    /// Pairs that the FPGA has marked as torn by a camera.
    pub torn: u64,
    /// The first problems in words.
    pub problems: Vec<String>,
    /// The counts of the last end record: pairs, sent, lost.
    pub end: Option<[u32; 3]>,
}

impl Findings {
    /// Whether nothing is wrong. Losses are wrong only where the counts differ.
    pub fn all_right(&self) -> bool {
        let Self { counts_differ, unended, disorder, reports_differ, pattern_wrong, torn, .. } =
            self;
        let all = [disorder, reports_differ, pattern_wrong, torn];
        *counts_differ == 0 && *unended == 0 && all.into_iter().all(|count| *count == 0)
    }

    fn problem(&mut self, text: impl FnOnce() -> String) {
        if self.problems.len() < DESCRIBED {
            self.problems.push(text());
        }
    }
}

/// The stream that is under way.
#[derive(Clone, Debug)]
struct Session {
    number: u16,
    /// The number that the next pair should have.
    next: u32,
    sent: u32,
    lost: u32,
    /// Pairs that are missing here and not counted by the FPGA, as told already.
    uncounted: u32,
    /// A pair's number and its report's sequence: the two count alike.
    sequence: Option<(u32, u8)>,
}

/// Takes a stream's records one after the other.
#[derive(Clone, Debug, Default)]
pub struct Checker {
    findings: Findings,
    /// Pixels are not looked at.
    counts_only: bool,
    session: Option<Session>,
    left: Option<Frame>,
}

impl Checker {
    /// One that looks at headers only: numbers, order and counts.
    pub fn of_headers() -> Self {
        Self { counts_only: true, ..Self::default() }
    }

    /// What was found so far.
    pub fn findings(&self) -> &Findings {
        &self.findings
    }

    /// The next record.
    pub fn take(&mut self, record: Record) {
        let header = *record.header();
        if self.session.as_ref().is_some_and(|session| session.number != header.session) {
            self.close();
        }
        if self.session.is_none() {
            self.findings.sessions += 1;
        }
        self.session.get_or_insert(Session {
            number: header.session,
            next: 0,
            sent: 0,
            lost: 0,
            uncounted: 0,
            sequence: None,
        });
        match record {
            Record::Frame(frame) => self.frame(frame),
            Record::End(header) => self.end(&header),
        }
    }

    /// No more records will come.
    pub fn finish(mut self) -> Findings {
        self.close();
        self.findings
    }

    /// A stream is over without its end record.
    fn close(&mut self) {
        self.odd_left();
        if let Some(session) = self.session.take() {
            self.findings.unended += 1;
            let number = session.number;
            self.findings.problem(|| format!("stream {number} has no end record: it was cut off"));
        }
    }

    fn odd_left(&mut self) {
        if let Some(left) = self.left.take() {
            self.disorder(&left.header, "its right eye is missing");
        }
    }

    fn disorder(&mut self, header: &StreamHeader, what: &str) {
        self.findings.disorder += 1;
        self.findings.problem(|| format!("pair {}: {what}", header.number));
    }

    fn frame(&mut self, frame: Frame) {
        if u32::from(frame.header.eye) == c::STREAM_EYE_LEFT {
            self.odd_left();
            self.left = Some(frame);
            return;
        }
        let Some(left) = self.left.take() else {
            return self.disorder(&frame.header, "its left eye is missing");
        };
        let same = StreamHeader { eye: frame.header.eye, ..left.header };
        if same != frame.header {
            return self.disorder(&frame.header, "its eyes do not belong together");
        }
        self.pair(&left, &frame);
    }

    fn pair(&mut self, left: &Frame, right: &Frame) {
        let header = right.header;
        self.count(&header);
        self.findings.pairs += 1;
        if right.has(c::STREAM_FLAG_TORN) {
            self.findings.torn += 1;
            self.findings.problem(|| format!("pair {}: torn by a camera", header.number));
        }
        let report = report_decode(&header.report).filter(|_| right.has(c::STREAM_FLAG_REPORT));
        let unsettled =
            |report: Report| u32::from(report.flags) & c::REPORT_EXPOSURE_UNSETTLED != 0;
        self.findings.unsettled += u64::from(report.is_some_and(unsettled));
        if self.counts_only {
            return;
        }
        if right.has(c::STREAM_FLAG_PATTERN) {
            self.pattern(left);
            self.pattern(right);
        }
        if right.has(c::STREAM_FLAG_REPORT) {
            self.report(left, right);
        }
    }

    /// Numbers only grow, and what is left out has been counted by the FPGA too.
    fn count(&mut self, header: &StreamHeader) {
        let Some(session) = &mut self.session else { return };
        if header.number < session.next {
            return self.disorder(header, "its number has been there before");
        }
        session.lost += header.number - session.next;
        self.findings.lost += u64::from(header.number - session.next);
        session.next = header.number.saturating_add(1);
        let (sent, lost, told) = (session.sent, session.lost, session.uncounted);
        session.sent += 1;
        if (header.sent, header.lost) != (sent.wrapping_add(told), lost.wrapping_sub(told)) {
            // What is missing is told once, not with every pair that follows.
            session.uncounted = lost.wrapping_sub(header.lost);
            let (theirs, ours) = (header.lost, lost);
            self.disorder(
                header,
                &format!("the FPGA has lost {theirs} pairs until here, {ours} are missing"),
            );
        }
    }

    fn end(&mut self, header: &StreamHeader) {
        self.odd_left();
        let Some(mut session) = self.session.take() else { return };
        let missing = header.number.saturating_sub(session.next);
        session.lost += missing;
        self.findings.lost += u64::from(missing);
        self.findings.end = Some([header.number, header.sent, header.lost]);
        let agrees = header.number >= session.next
            && (header.sent, header.lost) == (session.sent, session.lost);
        if !agrees {
            self.findings.counts_differ += 1;
            self.findings.problem(|| {
                format!(
                    "the FPGA has counted {} pairs sent and {} lost, here are {} and {} missing",
                    header.sent, header.lost, session.sent, session.lost
                )
            });
        }
    }

    fn pattern(&mut self, frame: &Frame) {
        let first = stream_pattern_first(frame.header.number, frame.header.eye);
        let right = |(n, pixel): (usize, &u16)| *pixel == first.wrapping_add(n as u16);
        if let Some(at) = frame.pixels.iter().enumerate().position(|pixel| !right(pixel)) {
            self.findings.pattern_wrong += 1;
            let (number, eye) = (frame.header.number, frame.eye());
            self.findings.problem(|| {
                format!("pair {number}, {eye} eye: pixel {at} of the pattern is wrong")
            });
        }
    }

    fn report(&mut self, left: &Frame, right: &Frame) {
        let header = &right.header;
        let Some(given) = report_decode(&header.report) else {
            return self.disorder(header, "its report is damaged");
        };
        if !right.is_of_a_camera() {
            return self.disorder(header, "no detector sees frames of this size");
        }
        self.sequence(header, &given);
        self.findings.reports += 1;
        let again = Report {
            function: given.function,
            sequence: given.sequence,
            exposure_time: (header.exposure_us / 100) as u16,
            delay: given.delay,
            ..seen(left, right)
        };
        let cameras = c::REPORT_EXPOSURE_UNSETTLED | c::REPORT_FRAME_TORN;
        let flags = again.flags | given.flags & cameras as u16;
        // The header's µs wrap elsewhere than the report's units of 100 µs.
        let time = given.exposure_time;
        if report_encode(&Report { flags, exposure_time: time, ..again }) != header.report {
            self.findings.reports_differ += 1;
            let number = header.number;
            self.findings
                .problem(|| format!("pair {number}: its report is not what its frames show"));
        } else if header.exposure_us < u32::MAX / 2 && again.exposure_time != time {
            self.disorder(header, "its report is of another exposure");
        }
    }

    fn sequence(&mut self, header: &StreamHeader, report: &Report) {
        let Some(session) = &mut self.session else { return };
        let before = session.sequence.replace((header.number, report.sequence));
        let Some((number, sequence)) = before else { return };
        if report.sequence.wrapping_sub(sequence) != header.number.wrapping_sub(number) as u8 {
            self.disorder(header, "its report's sequence does not fit its number");
        }
    }
}

/// What the detectors make of a pair.
fn seen(left: &Frame, right: &Frame) -> Report {
    let params = &right.header.params;
    if right.pixels.len() == WIDTH * HEIGHT {
        detect(&left.pixels, &right.pixels, params)
    } else {
        detect(&halve(&left.pixels), &halve(&right.pixels), params)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parser;
    use crate::tests_support::{end, frame, pattern};
    use common_sys::link::{
        STREAM_BLOCK, STREAM_HEADER_SIZE, stream_header_decode, stream_header_encode,
    };

    fn check(bytes: &[u8]) -> Findings {
        let mut parser = Parser::default();
        let mut checker = Checker::default();
        parser.push(bytes);
        while let Some((_, record)) = parser.next_record().expect("no damage") {
            checker.take(record);
        }
        checker.finish()
    }

    fn pair(number: u32, lost: u32) -> Vec<u8> {
        [frame(number, 0, lost), frame(number, 1, lost)].concat()
    }

    #[test]
    fn a_whole_stream_is_all_right() {
        let found = check(&[pair(0, 0), pair(1, 0), end(2, 2, 0)].concat());
        assert!(found.all_right(), "{found:?}");
        assert_eq!((found.pairs, found.lost, found.reports), (2, 0, 2));
        assert_eq!(found.end, Some([2, 2, 0]));
    }

    #[test]
    fn losses_that_both_sides_count_are_all_right() {
        let found = check(&[pair(0, 0), pair(3, 2), end(7, 2, 5)].concat());
        assert!(found.all_right(), "{found:?}");
        assert_eq!((found.pairs, found.lost), (2, 5));
    }

    #[test]
    fn a_pair_missing_on_the_way_is_found_by_its_counts() {
        let found = check(&[pair(0, 0), pair(2, 0), end(3, 3, 0)].concat());
        assert_eq!((found.disorder, found.counts_differ, found.lost), (1, 1, 1), "{found:?}");
    }

    #[test]
    fn what_is_missing_on_the_way_is_told_once() {
        let found = check(&[pair(0, 0), pair(2, 0), pair(3, 0), pair(5, 1), end(6, 5, 1)].concat());
        assert_eq!((found.disorder, found.counts_differ, found.lost), (1, 1, 2), "{found:?}");
        let found = check(&[pair(0, 0), pair(2, 0), pair(3, 0), pair(5, 0), end(6, 6, 0)].concat());
        assert_eq!((found.disorder, found.counts_differ, found.lost), (2, 1, 2), "{found:?}");
    }

    #[test]
    fn a_frame_missing_doubled_or_early_is_disorder() {
        for bytes in [
            [frame(0, 0, 0), pair(1, 1), end(2, 1, 1)].concat(),
            [frame(0, 1, 0), pair(1, 1), end(2, 1, 1)].concat(),
            [pair(0, 0), pair(0, 0), end(1, 1, 0)].concat(),
            [frame(0, 0, 0), frame(1, 1, 0), end(1, 0, 1)].concat(),
        ] {
            let found = check(&bytes);
            assert!(found.disorder > 0, "{found:?}");
        }
    }

    #[test]
    fn a_stream_without_end_is_unended() {
        assert_eq!(check(&pair(0, 0)).unended, 1);
    }

    /// A yellow square where grey was, in both eyes: a ball that the report does not know.
    fn with_a_ball(mut bytes: Vec<u8>) -> Vec<u8> {
        let record = frame(0, 0, 0).len();
        for eye in 0..2 {
            for y in 100..160 {
                for x in 100..160 {
                    let at = eye * record + STREAM_BLOCK + 2 * (y * WIDTH + x);
                    bytes[at..at + 2].copy_from_slice(&0xE6E6_u16.to_be_bytes());
                }
            }
        }
        bytes
    }

    #[test]
    fn one_changed_thing_that_matters_changes_the_report() {
        let bytes = with_a_ball([pair(0, 0), end(1, 1, 0)].concat());
        assert_eq!(check(&bytes).reports_differ, 1);
    }

    #[test]
    fn a_report_is_computed_again_with_the_parameters_of_its_own_header() {
        let mut bytes = with_a_ball([pair(0, 0), end(1, 1, 0)].concat());
        let record = frame(0, 0, 0).len();
        for header in [0, record] {
            let wire = &mut bytes[header..header + STREAM_HEADER_SIZE];
            let mut said = stream_header_decode((&*wire).try_into().unwrap()).unwrap();
            // So small a thing is no ball, as the report says.
            said.params.ball_min = 120;
            wire.copy_from_slice(&stream_header_encode(&said));
        }
        assert!(check(&bytes).all_right());
    }

    #[test]
    fn a_wrong_pixel_of_the_pattern_is_found() {
        let good = [pattern(0, 0), pattern(0, 1), end(1, 1, 0)].concat();
        assert!(check(&good).all_right());
        let mut bad = good.clone();
        bad[512 + 999] ^= 1;
        let found = check(&bad);
        assert_eq!(found.pattern_wrong, 1);
        assert!(found.problems[0].contains("pixel 499"), "{:?}", found.problems);
    }
}
