//! Functions and source lines of an FX2 program, from what sdcc left beside its image.

use std::fs;
use std::path::Path;

use fx2::symbols::Symbols;

/// Longer files are none of sdcc's for an 8051.
const FILE_MAX: u64 = 8 << 20;

/// The symbols of the program in `image`: from its map and, through its linker script, the listings of
/// its object files. What is not there, or older than the image by its own account, is done without.
pub fn beside(image: &Path) -> Symbols {
    let mut symbols = Symbols::parse(&text(&image.with_extension("map")));
    let folder = image.parent().unwrap_or(Path::new("."));
    for object in Symbols::objects(&text(&image.with_extension("lk"))) {
        symbols.add_listing(&text(&folder.join(object).with_extension("rst")));
    }
    symbols
}

/// The text of a file, empty if it has none.
fn text(path: &Path) -> String {
    let small = fs::metadata(path).is_ok_and(|data| data.is_file() && data.len() <= FILE_MAX);
    let bytes = if small { fs::read(path).unwrap_or_default() } else { Vec::new() };
    String::from_utf8_lossy(&bytes).into_owned()
}
