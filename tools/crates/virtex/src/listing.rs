//! A bitstream's packets, one by one, for people.

use crate::packet::{Command, Crc, Header, Register, SYNC_WORD};
use crate::part::FrameAddress;

/// One packet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Packet {
    /// Where its header begins, in bytes from the start of the raw stream.
    pub offset: usize,
    /// What it is: a register's name, `padding`, `sync`, or what is wrong.
    pub what: String,
    /// Words that follow the header.
    pub words: u32,
    /// The word, if it is one.
    pub value: Option<u32>,
    /// What that means.
    pub meaning: String,
    /// Nothing behind it can be understood, or its check sum is wrong.
    pub bad: bool,
}

impl Packet {
    fn plain(offset: usize, what: &str) -> Self {
        Self {
            offset,
            what: what.to_owned(),
            words: 0,
            value: None,
            meaning: String::new(),
            bad: false,
        }
    }
}

/// The packets of the raw stream `raw`, up to its end or the first that makes no sense. Padding and
/// dummy words in a row are one.
#[must_use]
pub fn packets(raw: &[u8]) -> Vec<Packet> {
    let sync = SYNC_WORD.to_be_bytes();
    let Some(start) = raw.windows(4).position(|bytes| bytes == sync) else { return Vec::new() };
    let mut list = vec![Packet::plain(start, "sync")];
    let mut at = start + 4;
    let mut crc = Crc::default();
    let mut register = None;
    while let Some(word) = word_at(raw, at) {
        let (address, count) = match Header::decode(word) {
            Header::Padding | Header::Resync => {
                pad(&mut list, at, word);
                at += 4;
                continue;
            }
            Header::Write { address, count } => (Some(address), count),
            Header::WriteMore { count } => (None, count),
            Header::Read => {
                list.push(bad(at, format!("{word:08X}: asks for a read")));
                break;
            }
            Header::Unknown => {
                list.push(bad(at, format!("{word:08X}: no packet header")));
                break;
            }
        };
        if let Some(address) = address {
            register = Register::from_address(address);
        }
        let end = at + 4 + 4 * count as usize;
        let Some(body) = raw.get(at + 4..end) else {
            list.push(bad(at, format!("a packet of {count} words, of which the last are missing")));
            break;
        };
        let Some(register) = register else {
            list.push(bad(at, format!("{word:08X}: a register that there is not")));
            break;
        };
        list.push(packet(at, register, count, body, &mut crc));
        at = end;
    }
    list
}

fn pad(list: &mut Vec<Packet>, at: usize, word: u32) {
    let what = if word == 0 { "padding" } else { "dummy or sync" };
    match list.last_mut() {
        Some(last) if last.what == what => last.words += 1,
        _ => list.push(Packet { words: 1, ..Packet::plain(at, what) }),
    }
}

fn bad(offset: usize, what: String) -> Packet {
    Packet { bad: true, ..Packet::plain(offset, &what) }
}

fn packet(offset: usize, register: Register, count: u32, body: &[u8], crc: &mut Crc) -> Packet {
    let words = body.as_chunks().0.iter().map(|&bytes| u32::from_be_bytes(bytes));
    let before = crc.value();
    for word in words.clone() {
        match register {
            Register::Cmd if Command::from_code(word) == Some(Command::Rcrc) => crc.clear(),
            // A check sum that was right leaves 0; a wrong one is told once.
            Register::Crc => crc.clear(),
            _ => crc.update(register, word),
        }
    }
    let value = words.clone().next().filter(|_| count == 1);
    let right = register != Register::Crc || value == Some(u32::from(before));
    Packet {
        offset,
        what: name(register).to_owned(),
        words: count,
        value,
        meaning: match (register, value) {
            (Register::Crc, _) if right => "right".to_owned(),
            (Register::Crc, _) => format!("WRONG, what came before has {before:04X}"),
            (Register::Cmd, Some(code)) => Command::from_code(code)
                .map_or("no such command".to_owned(), |command| {
                    format!("{command:?}").to_uppercase()
                }),
            (Register::Far, Some(far)) => {
                let FrameAddress { block, major, minor } = FrameAddress::from_far(far);
                format!("block {block}, column {major}, frame {minor}")
            }
            (Register::Flr, Some(flr)) => format!("frames of {} words", flr + 1),
            _ => String::new(),
        },
        bad: !right,
    }
}

fn name(register: Register) -> &'static str {
    match register {
        Register::Crc => "CRC",
        Register::Far => "FAR",
        Register::Fdri => "FDRI",
        Register::Cmd => "CMD",
        Register::Ctl => "CTL",
        Register::Mask => "MASK",
        Register::Lout => "LOUT",
        Register::Cor => "COR",
        Register::Flr => "FLR",
    }
}

fn word_at(raw: &[u8], at: usize) -> Option<u32> {
    raw.get(at..)?.first_chunk().map(|&bytes| u32::from_be_bytes(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bitstream::{Options, make, make_partial};
    use crate::design::Function;

    #[test]
    fn all_packets_of_a_good_stream_are_understood_to_its_end() {
        for raw in [
            make(Function::Soccer, &Options::default()),
            make_partial(Function::Capture, &Options::default()),
        ] {
            let list = packets(&raw);
            assert!(list.iter().all(|packet| !packet.bad), "{list:#?}");
            let sums = list.iter().filter(|packet| packet.what == "CRC");
            assert!(sums.clone().count() > 0 && sums.clone().all(|p| p.meaning == "right"));
            let last = list.last().unwrap();
            let header = usize::from(last.what != "padding");
            assert_eq!(last.offset + 4 * (last.words as usize + header), raw.len());
        }
    }

    #[test]
    fn a_changed_bit_is_a_wrong_check_sum_and_a_cut_is_told() {
        let mut raw = make(Function::Soccer, &Options::default());
        raw[100_000] ^= 4;
        let wrong: Vec<Packet> = packets(&raw).into_iter().filter(|packet| packet.bad).collect();
        assert_eq!(wrong.len(), 1);
        assert!(wrong[0].what == "CRC" && wrong[0].meaning.starts_with("WRONG"));
        let cut = packets(&raw[..1000]);
        assert!(cut.last().unwrap().what.contains("missing"));
        assert_eq!(packets(b"no bitstream"), []);
    }
}
