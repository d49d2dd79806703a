//! What happens to a twin's eyes, and when: `--camera-fault`, `--lamps`.

use std::str::FromStr;

use sim::{Ps, SECOND};
use twin::sensor::{CameraBus, Fault};

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Camera(Fault),
    StuckClock,
    NoMux,
}

const KINDS: [(&str, Kind); 6] = [
    ("no-ack", Kind::Camera(Fault::NoAck)),
    ("wrong-id", Kind::Camera(Fault::WrongId)),
    ("no-pixels", Kind::Camera(Fault::NoPixels)),
    ("torn", Kind::Camera(Fault::TornFrames)),
    ("stuck-clock", Kind::StuckClock),
    ("no-mux", Kind::NoMux),
];

/// A fault for some time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraFault {
    kind: Kind,
    /// Left, right.
    eyes: [bool; 2],
    from: Ps,
    until: Ps,
}

impl FromStr for CameraFault {
    type Err = String;

    /// `[left:|right:]KIND[@FROM[..UNTIL]]`, in seconds.
    fn from_str(text: &str) -> Result<Self, String> {
        let (what, when) = text.split_once('@').unwrap_or((text, "0"));
        let (eyes, kind) = match what.split_once(':') {
            Some(("left", kind)) => ([true, false], kind),
            Some(("right", kind)) => ([false, true], kind),
            Some(_) => return Err("the eye is left or right".into()),
            None => ([true, true], what),
        };
        let found = KINDS.iter().find(|(name, _)| *name == kind).map(|(_, kind)| *kind);
        let names = || KINDS.map(|(name, _)| name).join(", ");
        let kind = found.ok_or_else(|| format!("there are the faults {}", names()))?;
        let (from, until) = parse_period(when)?;
        Ok(Self { kind, eyes, from, until })
    }
}

/// `FROM[..UNTIL]`, in seconds.
fn parse_period(when: &str) -> Result<(Ps, Ps), String> {
    let time = |text: &str| match text.parse::<f64>() {
        Ok(seconds) if (0.0..1e6).contains(&seconds) => Ok((seconds * SECOND as f64) as Ps),
        _ => Err(format!("\"{text}\" is no time; give seconds, as 2 or 2..5")),
    };
    Ok(match when.split_once("..") {
        Some((from, until)) => (time(from)?, time(until)?),
        None => (time(when)?, Ps::MAX),
    })
}

/// Lamps that are dimmer or brighter for some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamps {
    factor: f32,
    from: Ps,
    until: Ps,
}

impl FromStr for Lamps {
    type Err = String;

    /// `FACTOR[@FROM[..UNTIL]]`, in seconds.
    fn from_str(text: &str) -> Result<Self, String> {
        let (factor, when) = text.split_once('@').unwrap_or((text, "0"));
        let (from, until) = parse_period(when)?;
        match factor.parse() {
            Ok(factor) if (0.0..=100.0).contains(&factor) => Ok(Self { factor, from, until }),
            _ => Err(format!("\"{factor}\" is no factor; give 0 to 100, 1 is as usual")),
        }
    }
}

/// The light as it is at `now`; of several lamps the last one counts.
pub fn light(lamps: &[Lamps], now: Ps, cameras: &mut CameraBus) {
    let lit = lamps.iter().rev().find(|lamps| (lamps.from..lamps.until).contains(&now));
    cameras.lamps = lit.map_or(1.0, |lamps| lamps.factor);
}

/// The cameras as they are at `now`.
pub fn apply(faults: &[CameraFault], now: Ps, cameras: &mut CameraBus) {
    if faults.is_empty() {
        return;
    }
    let active = || faults.iter().filter(|fault| (fault.from..fault.until).contains(&now));
    cameras.clock_held = active().any(|fault| fault.kind == Kind::StuckClock);
    cameras.mux_present = !active().any(|fault| fault.kind == Kind::NoMux);
    for (eye, camera) in cameras.eyes.iter_mut().enumerate() {
        camera.fault =
            active().filter(|fault| fault.eyes[eye]).find_map(|fault| match fault.kind {
                Kind::Camera(fault) => Some(fault),
                Kind::StuckClock | Kind::NoMux => None,
            });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_come_and_go_at_their_times() {
        let faults: Vec<CameraFault> =
            ["left:no-ack@1..2", "stuck-clock@3"].map(|text| text.parse().expect("a fault")).into();
        let mut cameras = CameraBus::default();
        let mut at = |seconds: f64| {
            apply(&faults, (seconds * SECOND as f64) as Ps, &mut cameras);
            (cameras.eyes[0].fault, cameras.eyes[1].fault, cameras.clock_held)
        };
        assert_eq!(at(0.5), (None, None, false));
        assert_eq!(at(1.0), (Some(Fault::NoAck), None, false));
        assert_eq!(at(2.0), (None, None, false));
        assert_eq!(at(3.5), (None, None, true));
    }

    #[test]
    fn lamps_are_switched_at_their_times() {
        let lamps: Vec<Lamps> = ["0.5@1", "2@3..4"].map(|text| text.parse().expect("lamps")).into();
        let mut cameras = CameraBus::default();
        let mut at = |seconds: f64| {
            light(&lamps, (seconds * SECOND as f64) as Ps, &mut cameras);
            cameras.lamps
        };
        assert_eq!([at(0.5), at(2.0), at(3.0), at(4.0)], [1.0, 0.5, 2.0, 0.5]);
        for text in ["", "bright", "-1", "1@x", "101"] {
            assert!(text.parse::<Lamps>().is_err(), "{text}");
        }
    }

    #[test]
    fn nonsense_is_refused() {
        for text in ["", "up:no-ack", "no-ack@x", "no-ack@2..", "broken", "left:@1"] {
            assert!(text.parse::<CameraFault>().is_err(), "{text}");
        }
    }
}
