//! What the base says on its serial line, line by line.

use serde_json::{Value, json};

/// Longer than any line of the base: what has no end is shown in pieces.
const LINE_MAX: usize = 4096;

/// Takes lines together.
#[derive(Default)]
pub struct Splitter {
    line: Vec<u8>,
}

impl Splitter {
    /// The lines that end in `bytes`. An ending is CR, LF or both; empty lines are left out.
    pub fn take(&mut self, bytes: &[u8]) -> Vec<String> {
        let mut lines = Vec::new();
        for &byte in bytes {
            if matches!(byte, b'\r' | b'\n') || self.line.len() == LINE_MAX {
                lines.extend(self.rest());
            }
            // XON and XOFF are between the two ends of the line.
            if !matches!(byte, b'\r' | b'\n' | 0x11 | 0x13) {
                self.line.push(byte);
            }
        }
        lines
    }

    /// What has come of a line that has not ended.
    pub fn rest(&mut self) -> Option<String> {
        let line = std::mem::take(&mut self.line);
        (!line.is_empty()).then(|| String::from_utf8_lossy(&line).into_owned())
    }
}

/// What a line is.
#[derive(Clone, Debug, PartialEq)]
pub enum Said {
    /// `~MS,VALUE,...`: streamed variables.
    Stream {
        /// Time at the base, ms.
        ms: f64,
        /// In the order of the `stream` command.
        values: Vec<f64>,
    },
    /// `[SECONDS MODULE LEVEL] text`.
    Log {
        /// Time at the base.
        seconds: f64,
        /// Who says it.
        module: String,
        /// How grave it is.
        level: String,
    },
    /// `error: cause; cure`, or K-Team's `z,...`.
    Error,
    /// Anything else.
    Reply,
}

impl Said {
    /// What `line` is.
    pub fn of(line: &str) -> Self {
        stream(line).or_else(|| log(line)).unwrap_or_else(|| {
            let error = line.starts_with("error:") || line.starts_with("z,");
            if error { Self::Error } else { Self::Reply }
        })
    }

    /// The line as a JSON object; `names` are those of the streamed variables, as far as known.
    pub fn as_json(&self, seconds: f64, line: &str, names: &[String]) -> Value {
        let mut object = json!({ "t": seconds, "line": line });
        let more = match self {
            Self::Stream { ms, values } => {
                let name = |n: usize| names.get(n).cloned().unwrap_or_else(|| format!("v{n}"));
                let named: serde_json::Map<String, Value> =
                    values.iter().enumerate().map(|(n, value)| (name(n), json!(value))).collect();
                json!({ "kind": "stream", "ms": ms, "values": named })
            }
            Self::Log { seconds, module, level } => {
                json!({ "kind": "log", "seconds": seconds, "module": module, "level": level })
            }
            Self::Error => json!({ "kind": "error" }),
            Self::Reply => json!({ "kind": "reply" }),
        };
        if let (Value::Object(object), Value::Object(more)) = (&mut object, more) {
            object.extend(more);
        }
        object
    }

    /// The line as a terminal shows it.
    pub fn coloured(&self, line: &str) -> String {
        const GREY: &str = "\x1b[90m";
        const RED: &str = "\x1b[31m";
        const YELLOW: &str = "\x1b[33m";
        const CYAN: &str = "\x1b[36m";
        let colour = match self {
            Self::Error => RED,
            Self::Stream { .. } => CYAN,
            Self::Log { level, .. } => match level.to_ascii_lowercase().as_str() {
                "error" | "fatal" => RED,
                "warning" | "warn" => YELLOW,
                _ => GREY,
            },
            Self::Reply => return line.to_owned(),
        };
        format!("{colour}{line}\x1b[0m")
    }
}

fn stream(line: &str) -> Option<Said> {
    let mut numbers = line.strip_prefix('~')?.split(',').map(|n| n.trim().parse::<f64>());
    let ms = numbers.next()?.ok()?;
    let values = numbers.collect::<Result<Vec<f64>, _>>().ok()?;
    Some(Said::Stream { ms, values })
}

fn log(line: &str) -> Option<Said> {
    let (head, _) = line.strip_prefix('[')?.split_once(']')?;
    let mut words = head.split_whitespace();
    let (seconds, module, level) = (words.next()?, words.next()?, words.next()?);
    let seconds = seconds.parse().ok()?;
    Some(Said::Log { seconds, module: module.to_owned(), level: level.to_owned() })
}

/// The variables that the reply to a `stream` command names, without the time.
pub fn streamed_names(line: &str) -> Option<Vec<String>> {
    let list = line.strip_prefix("ok: stream ")?;
    let names = list.split_whitespace().next()?.split(',').map(str::to_owned);
    let names: Vec<String> = names.filter(|name| name != "time_ms").collect();
    (!names.is_empty() && names[0] != "off").then_some(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_with_cr_or_lf_or_both_wherever_the_pieces_end() {
        let mut splitter = Splitter::default();
        let mut lines = Vec::new();
        for piece in [
            &b"h,1"[..],
            b",2\r",
            b"\n\r\n\x13[0.1\x11 a",
            b" info] x\nz,Pro",
            b"tocol error\r\nrest",
        ] {
            lines.extend(splitter.take(piece));
        }
        assert_eq!(lines, ["h,1,2", "[0.1 a info] x", "z,Protocol error"]);
        assert_eq!(splitter.rest().as_deref(), Some("rest"));
    }

    #[test]
    fn a_flood_without_an_end_comes_in_pieces() {
        let lines = Splitter::default().take(&[b'x'; 3 * LINE_MAX]);
        assert_eq!(lines.iter().map(String::len).collect::<Vec<_>>(), [LINE_MAX; 2]);
    }

    #[test]
    fn lines_are_told_apart() {
        assert_eq!(Said::of("~1250,3,-4.5"), Said::Stream { ms: 1250.0, values: vec![3.0, -4.5] });
        let log = Said::Log { seconds: 1.25, module: "motion".into(), level: "warn".into() };
        assert_eq!(Said::of("[1.250 motion warn] wheel left does not turn"), log);
        assert_eq!(Said::of("error: no such command; help lists them"), Said::Error);
        assert_eq!(Said::of("z,Protocol error"), Said::Error);
        for reply in ["~x,1", "~1,2,", "[a b]", "ok: playing", "n,0,0,0"] {
            assert_eq!(Said::of(reply), Said::Reply, "{reply}");
        }
    }

    #[test]
    fn streamed_variables_get_the_names_of_the_command() {
        let names = streamed_names("ok: stream time_ms,pose.x,pose.y").expect("names");
        let json = Said::of("~10,1,2").as_json(0.5, "~10,1,2", &names);
        assert_eq!(json["values"], json!({ "pose.x": 1.0, "pose.y": 2.0 }));
        assert_eq!(json["kind"], "stream");
        assert_eq!(streamed_names("ok: stream off"), None);
    }
}
