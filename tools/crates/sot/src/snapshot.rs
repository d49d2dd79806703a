//! Snapshots of `sot twin fx2`: the chip and its EEPROM as they are at one moment, in a file.

use std::path::Path;

use anyhow::{Context, Result, bail};
use fx2::Fx2;
use fx2::eeprom::Eeprom;
use serde::{Deserialize, Serialize};
use sim::TraceHash;

use crate::output::write_file;
use crate::twin::read_limited;

/// What the file says it is.
const FORMAT: &str = "stereosot fx2 snapshot";
/// Changes with every change of what is in it.
const VERSION: u32 = 1;
/// Longer files are none of ours.
const FILE_MAX: u64 = 16 << 20;

/// A chip and what keeps its contents on the board.
#[derive(Serialize, Deserialize)]
pub struct Snapshot {
    /// The chip.
    pub chip: Fx2,
    /// Its boot EEPROM, if there is one.
    pub eeprom: Option<Eeprom>,
}

/// The file: the state as text, so that a check sum can be had of it.
#[derive(Serialize, Deserialize)]
struct File {
    format: String,
    version: u32,
    check: u64,
    state: String,
}

fn check(state: &str) -> u64 {
    let mut hash = TraceHash::default();
    hash.update(state.as_bytes());
    hash.value()
}

impl Snapshot {
    /// Writes it to `path`.
    pub fn save(&self, path: &Path) -> Result<()> {
        let state = serde_json::to_string(self)?;
        let file = File { format: FORMAT.into(), version: VERSION, check: check(&state), state };
        write_file(path, &serde_json::to_vec(&file)?)
    }

    /// Reads it back.
    pub fn restore(path: &Path) -> Result<Self> {
        let bytes = read_limited(path, FILE_MAX, "it is no snapshot")?;
        let file: File = serde_json::from_slice(&bytes)
            .ok()
            .filter(|file: &File| file.format == FORMAT)
            .with_context(|| format!("{} is no snapshot of `sot twin fx2`", path.display()))?;
        if file.version != VERSION {
            bail!("{} is from another version of sot; save it anew", path.display());
        }
        if file.check != check(&file.state) {
            bail!("{} is damaged: its check sum is wrong", path.display());
        }
        serde_json::from_str(&file.state).with_context(|| {
            format!("{} is from another build of sot; save it anew", path.display())
        })
    }
}
