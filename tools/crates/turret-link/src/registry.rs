//! Where running twins say that they are there.
//!
//! Each has a small JSON file in `$XDG_RUNTIME_DIR/stereosot` (without that variable: in
//! `stereosot-UID` in the folder for temporary files) and holds a lock on it as long as it runs. The
//! system drops the lock when the process ends, however it ends: a file that can be locked is stale.

use std::fs::{self, DirBuilder, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::{env, process};

use serde::{Deserialize, Serialize};

/// Only for us: who can talk to a twin's socket can do anything with it.
const FOLDER_MODE: u32 = 0o700;
/// Twins of one process.
const TWINS_MAX: u32 = 100;

/// What a twin is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A whole robot.
    Robot,
    /// An FX2 alone.
    Fx2,
    /// A base alone.
    Khepera,
}

impl Kind {
    /// Its name in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Robot => "robot",
            Self::Fx2 => "fx2",
            Self::Khepera => "khepera",
        }
    }
}

/// A twin as it tells of itself.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Twin {
    /// What it is.
    pub kind: Kind,
    /// HOST:PORT of its USB, if that is served.
    pub usbredir: Option<String>,
    /// Its serial line, if there is one.
    pub serial: Option<PathBuf>,
}

/// A twin that runs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Running {
    /// Its process.
    pub pid: u32,
    /// What it is.
    #[serde(flatten)]
    pub twin: Twin,
}

/// As long as this lives, the twin is listed.
#[derive(Debug)]
pub struct Entry {
    path: PathBuf,
    _locked: File,
}

impl Drop for Entry {
    fn drop(&mut self) {
        // A file that stays is recognised as stale.
        let _ = fs::remove_file(&self.path);
    }
}

/// The folder.
///
/// # Errors
/// If it cannot be told.
fn folder() -> io::Result<PathBuf> {
    match env::var_os("XDG_RUNTIME_DIR").filter(|folder| !folder.is_empty()) {
        Some(folder) => Ok(PathBuf::from(folder).join("stereosot")),
        None => Ok(env::temp_dir().join(format!("stereosot-{}", own_uid()?))),
    }
}

fn own_uid() -> io::Result<u32> {
    Ok(fs::metadata("/proc/self")?.uid())
}

/// Lists this process's `twin` as long as the returned entry lives.
///
/// # Errors
/// If the folder cannot be made, or belongs to somebody else.
pub fn register(twin: &Twin) -> io::Result<Entry> {
    register_in(&folder()?, twin)
}

/// All twins that run now. Files of others that have ended are removed.
///
/// # Errors
/// If the folder cannot be read, or belongs to somebody else.
pub fn running() -> io::Result<Vec<Running>> {
    running_in(&folder()?)
}

fn check_owner(folder: &Path) -> io::Result<()> {
    if fs::metadata(folder)?.uid() == own_uid()? {
        return Ok(());
    }
    let text = format!("{} belongs to somebody else; set XDG_RUNTIME_DIR", folder.display());
    Err(io::Error::new(ErrorKind::PermissionDenied, text))
}

fn register_in(folder: &Path, twin: &Twin) -> io::Result<Entry> {
    DirBuilder::new().recursive(true).mode(FOLDER_MODE).create(folder)?;
    check_owner(folder)?;
    let pid = process::id();
    for number in 0..TWINS_MAX {
        let path = folder.join(format!("{pid}-{number}.json"));
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => continue,
            Err(TryLockError::Error(error)) => return Err(error),
        }
        // Between opening and locking it may have been removed as stale.
        let same = fs::metadata(&path).is_ok_and(|there| {
            file.metadata().is_ok_and(|ours| (there.dev(), there.ino()) == (ours.dev(), ours.ino()))
        });
        if !same {
            continue;
        }
        file.set_len(0)?;
        let text = serde_json::to_string(&Running { pid, twin: twin.clone() })?;
        file.write_all(text.as_bytes())?;
        return Ok(Entry { path, _locked: file });
    }
    Err(io::Error::other(format!("this process has {TWINS_MAX} twins already")))
}

fn running_in(folder: &Path) -> io::Result<Vec<Running>> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    check_owner(folder)?;
    let mut found = Vec::new();
    for entry in entries {
        let path = entry?.path();
        if path.extension().is_none_or(|ending| ending != "json") {
            continue;
        }
        if is_stale(&path) {
            let _ = fs::remove_file(&path);
            continue;
        }
        // One that is just being written is listed the next time.
        let text = fs::read_to_string(&path).unwrap_or_default();
        found.extend(serde_json::from_str::<Running>(&text).ok());
    }
    found.sort_by_key(|running| (running.pid, running.twin.usbredir.clone()));
    Ok(found)
}

fn is_stale(path: &Path) -> bool {
    // One that has gone in the meantime is not there to be removed.
    File::open(path).is_ok_and(|file| file.try_lock().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn robot(port: u16) -> Twin {
        let usbredir = Some(format!("127.0.0.1:{port}"));
        Twin { kind: Kind::Robot, usbredir, serial: Some("/dev/pts/7".into()) }
    }

    #[test]
    fn twins_are_listed_while_they_run() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("made");
        assert_eq!(running_in(&folder).unwrap(), []);
        let first = register_in(&folder, &robot(4000)).unwrap();
        let second = register_in(&folder, &robot(4001)).unwrap();
        let pid = process::id();
        let both = [4000, 4001].map(|port| Running { pid, twin: robot(port) });
        assert_eq!(running_in(&folder).unwrap(), both);
        drop(first);
        assert_eq!(running_in(&folder).unwrap(), both[1..]);
        drop(second);
        assert_eq!(running_in(&folder).unwrap(), []);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
    }

    #[test]
    fn a_file_that_nobody_holds_is_stale_and_goes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("77-0.json");
        let text = serde_json::to_string(&Running { pid: 77, twin: robot(4000) }).unwrap();
        fs::write(&path, text).unwrap();
        assert_eq!(running_in(folder.path()).unwrap(), []);
        assert!(!path.exists());
    }
}
