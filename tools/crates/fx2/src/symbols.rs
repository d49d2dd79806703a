//! Functions and source lines of a program, from what sdcc writes beside the .ihx: the linker's map has
//! the global functions (with `--debug` lines and static functions as well), the relocated listings
//! (.rst, one for each object file that the linker's .lk names) have everything.

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

    /// The object files that a linker script (`fx2-firmware.lk`) names.
    pub fn objects(script: &str) -> impl Iterator<Item = &str> {
        script
            .lines()
            .map(str::trim)
            .filter(|line| line.ends_with(".rel") && !line.starts_with('-'))
    }

    /// Takes the functions and lines of a relocated listing (.rst) in. Lines without a place in code are
    /// passed over.
    pub fn add_listing(&mut self, listing: &str) {
        let mut in_code = false;
        let mut source: Option<(&str, u32)> = None;
        for text in listing.lines() {
            if let Some((_, area)) = text.split_once(".area ") {
                in_code = area.contains("CODE");
            }
            if let Some((_, comment)) = text.split_once(";\t") {
                source = source_of(comment).or(source);
                continue;
            }
            // "      0000B1 74 80            [12]  206 \tmov\ta,#0x80", "      0000B0   130 _choose:"
            let address = text.get(6..12).and_then(|hex| u16::from_str_radix(hex, 16).ok());
            let Some(address) = address.filter(|_| in_code && text.starts_with("      ")) else {
                continue;
            };
            let label = text.rsplit(' ').next().and_then(|word| word.trim_end().strip_suffix(':'));
            if let Some(name) =
                label.and_then(|label| label.trim_end_matches(':').strip_prefix('_'))
            {
                self.functions.insert(address, name.to_owned());
                source = None;
            } else if let Some((file, line)) = source.take() {
                self.lines.insert(address, (file.to_owned(), line));
            }
        }
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

/// File name and line of a listing's comment "path/file.c:50: text".
fn source_of(comment: &str) -> Option<(&str, u32)> {
    let mut parts = comment.splitn(3, ':');
    let (path, line, _text) = (parts.next()?, parts.next()?, parts.next()?);
    let file = path.rsplit('/').next()?;
    Some((file, line.parse().ok()?))
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

    /// As sdcc 4.2 writes it, shortened.
    const LISTING: &str = "\
                                     83 \t.area XSEG    (XDATA)
      00E000                         84 _buffer:
      00E000                         85 \t.ds 64
                                    101 \t.area CSEG    (CODE)
                                    120 ;\t../app/cameras.c:14: static void choose(uint8_t eye)
      0000B0                        130 _choose:
      0000B0 AF 82            [24]  131 \tmov\tr7,dpl
                                    132 ;\t../app/cameras.c:16: SELECT = eye;
      0000B2 90 E6 04         [24]  133 \tmov\tdptr,#_SELECT
      0000B5 EF               [12]  134 \tmov\ta,r7
      0000B6                        135 00102$:
";

    #[test]
    fn a_listing_has_static_functions_and_lines() {
        let mut symbols = Symbols::parse("C:   00000100  _main                     main\n");
        symbols.add_listing(LISTING);
        symbols.add_listing("no listing at all;\t\n      zz");
        assert_eq!(symbols.locate(0xB5).unwrap().to_string(), "choose+0x5, cameras.c:16");
        assert_eq!(symbols.locate(0xB0).unwrap().line, None);
        assert_eq!(symbols.locate(0x100).unwrap().to_string(), "main+0x0");
        let script = "-muwx\n-i x.ihx\n-l mcs51\napp/cameras.c.rel\n./main.rel\n\n-e\n";
        assert!(Symbols::objects(script).eq(["app/cameras.c.rel", "./main.rel"]));
    }

    #[test]
    fn a_map_without_debug_has_functions_only() {
        let symbols = Symbols::parse("C:   00000A5D  _clock_start                       clock\n");
        assert_eq!(symbols.locate(0xA60).unwrap().to_string(), "clock_start+0x3");
        assert!(Symbols::parse("C: zz _x y\nC:\nnonsense").is_empty());
    }
}
