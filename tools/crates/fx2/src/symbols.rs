//! Functions and source lines of a program, from the linker's map that sdcc writes beside the .ihx.
//! With `--debug` the map has lines and static functions as well.

use crate::Diagnostic;
use std::collections::BTreeMap;
use std::fmt;

/// Where an address lies in the source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place<'a> {
    /// The function, or the label before the address.
    pub function: &'a str,
    /// Bytes from its beginning.
    pub offset: u16,
    /// Source file and line, if the map has them.
    pub line: Option<(&'a str, u32)>,
}

impl fmt::Display for Place<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}+{:#x}", self.function, self.offset)?;
        match self.line {
            Some((file, line)) => write!(f, ", {file}:{line}"),
            None => Ok(()),
        }
    }
}

/// The symbols of one program.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Symbols {
    functions: BTreeMap<u16, String>,
    lines: BTreeMap<u16, (String, u32)>,
}

impl Symbols {
    /// Reads a map (`fx2-firmware.map`). Lines that are none of sdld's code symbols are passed over,
    /// so that a file which is no map gives no symbols.
    #[must_use]
    pub fn parse(map: &str) -> Self {
        let mut symbols = Self::default();
        for text in map.lines() {
            // "C:   00000A5D  _clock_start      clock"
            let Some(rest) = text.trim_start().strip_prefix("C:") else { continue };
            let mut words = rest.split_whitespace();
            let (Some(address), Some(name), Some(_module)) =
                (words.next(), words.next(), words.next())
            else {
                continue;
            };
            let hex = match address.trim_start_matches('0') {
                "" => "0",
                digits => digits,
            };
            if let Ok(address) = u16::from_str_radix(hex, 16) {
                symbols.add(address, name);
            }
        }
        symbols
    }

    fn add(&mut self, address: u16, name: &str) {
        let parts: Vec<&str> = name.split('$').collect();
        match parts[..] {
            // C$file.c$line$block$level
            ["C", file, line, ..] => {
                if let Ok(line) = line.parse() {
                    self.lines.insert(address, (file.to_owned(), line));
                }
            }
            // Fmodule$name$.. is a static function, G$name$.. a global one.
            [scope, name, ..] if scope.starts_with('F') || scope == "G" => {
                self.functions.insert(address, name.to_owned());
            }
            [label] if label.starts_with('_') => {
                self.functions.entry(address).or_insert_with(|| label[1..].to_owned());
            }
            _ => {}
        }
    }

    /// Whether nothing was found.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.functions.is_empty()
    }

    /// The place of `address`; `None` before the first function.
    #[must_use]
    pub fn locate(&self, address: u16) -> Option<Place<'_>> {
        let (start, function) = self.functions.range(..=address).next_back()?;
        // A line belongs to the function only if it lies in it.
        let line = self.lines.range(start..=&address).next_back();
        Some(Place {
            function,
            offset: address - start,
            line: line.map(|(_, (file, line))| (file.as_str(), *line)),
        })
    }

    /// A finding with its place in the source.
    #[must_use]
    pub fn describe(&self, found: &Diagnostic) -> String {
        match self.locate(found.pc) {
            Some(place) => format!("at {:#06x} ({place}): {}", found.pc, found.text),
            None => found.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rule;

    /// As sdcc 4.2 --debug writes it, shortened.
    const MAP: &str = "\
HOME                                00000000    00000006 =           6. bytes (REL,CON,CODE)
      Value  Global                              Global Defined In Module
C:   00000000  l_BSEG
C:   00000062  A$t$137                            t
C:   00000062  C$t.c$3$0_0$2                      t
C:   00000062  Ft$helper$0$0                      t
C:   00000064  C$t.c$4$1_0$2                      t
C:   0000006D  XFt$helper$0$0                     t
C:   0000006E  C$t.c$7$1_0$5                      t
C:   0000006E  G$main$0$0                         t
C:   0000006E  _main                              t
     0000E62A  _r                                 t
";

    #[test]
    fn an_address_is_found_in_its_function_and_line() {
        let symbols = Symbols::parse(MAP);
        let place = symbols.locate(0x68).unwrap();
        assert_eq!(place, Place { function: "helper", offset: 6, line: Some(("t.c", 4)) });
        assert_eq!(symbols.locate(0x70).unwrap().to_string(), "main+0x2, t.c:7");
        assert_eq!(symbols.locate(0x10), None);
    }

    #[test]
    fn a_finding_is_told_with_its_place() {
        let found = Diagnostic {
            pc: 0x67,
            rule: Rule::NotModelled,
            address: 0xE62A,
            text: "0xe62a is touched".into(),
        };
        assert_eq!(
            Symbols::parse(MAP).describe(&found),
            "at 0x0067 (helper+0x5, t.c:4): 0xe62a is touched"
        );
        assert_eq!(Symbols::default().describe(&found), found.to_string());
    }

    #[test]
    fn a_map_without_debug_has_functions_only() {
        let symbols = Symbols::parse("C:   00000A5D  _clock_start                       clock\n");
        assert_eq!(symbols.locate(0xA60).unwrap().to_string(), "clock_start+0x3");
        assert!(Symbols::parse("C: zz _x y\nC:\nnonsense").is_empty());
    }
}
