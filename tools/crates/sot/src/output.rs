//! Writing results: never half a file, and wrong use told apart from failure.

use std::fs::{self, Permissions};
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use anyhow::{Context, Result};

/// The user asked for something that cannot be asked for; exit code 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Usage(pub String);

/// Write `bytes` to `path`, whole or not at all: an interruption leaves what was there before.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let put = || -> std::io::Result<()> {
        // A device or a pipe cannot be renamed over.
        if path.exists() && !path.metadata()?.is_file() {
            return fs::write(path, bytes);
        }
        // As readable as any new file: the user's umask decides, not the temporary file's caution.
        let mut file = tempfile::Builder::new()
            .prefix(".sot-")
            .permissions(Permissions::from_mode(0o666))
            .tempfile_in(folder)?;
        file.write_all(bytes)?;
        file.persist(path).map_err(|error| error.error)?;
        Ok(())
    };
    put().with_context(|| format!("cannot write {}", path.display()))
}

/// The bytes of `path`, or an error that names it.
pub fn read_file(path: &Path) -> Result<Vec<u8>> {
    fs::read(path).with_context(|| format!("cannot read {}", path.display()))
}

/// Write `picture` to `path` as PNG.
pub fn write_picture(path: &Path, picture: image::RgbImage) -> Result<()> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture
        .write_to(&mut bytes, image::ImageFormat::Png)
        .with_context(|| format!("cannot make a PNG for {}", path.display()))?;
    write_file(path, bytes.get_ref())
}
