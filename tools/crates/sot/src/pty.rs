//! A pseudo-terminal for the serial line of an emulated base.
//!
//! It is what a cable is: nobody needs to be at the other end, what is sent meanwhile is lost, and
//! clients may come and go. The client's baud rate means nothing here: the emulated line has its own.

use std::fs;
use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};

/// Our end of a pseudo-terminal, without blocking, and the link that clients find it by.
pub struct Pty {
    master: OwnedFd,
    path: PathBuf,
    link: Option<PathBuf>,
    attached: bool,
}

impl Pty {
    /// A raw pseudo-terminal; `link`, if given, becomes a symbolic link to it, in the place of an
    /// older one.
    pub fn open(link: Option<&Path>) -> Result<Self> {
        let no_pty = "the system gives no pseudo-terminal";
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let master = openpt(flags).context(no_pty)?;
        grantpt(&master).context(no_pty)?;
        unlockpt(&master).context(no_pty)?;
        let name = ptsname(&master, Vec::new()).context(no_pty)?;
        let path = PathBuf::from(name.to_str().context("the pseudo-terminal has no name")?);
        make_raw(&path).with_context(|| format!("cannot set {} up", path.display()))?;
        rustix::fs::fcntl_setfl(&master, OFlags::NONBLOCK).context(no_pty)?;
        if let Some(link) = link {
            put_link(&path, link)?;
        }
        Ok(Self { master, path, link: link.map(Path::to_owned), attached: false })
    }

    /// The device that clients open: the link if there is one.
    pub fn name(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.path)
    }

    /// Wait for something to read, at most `limit`; without a client, for all of it.
    pub fn wait(&self, limit: Duration) {
        if !self.attached {
            thread::sleep(limit);
            return;
        }
        let nanoseconds = i64::from(limit.subsec_nanos());
        let limit = Timespec {
            tv_sec: i64::try_from(limit.as_secs()).unwrap_or(i64::MAX),
            tv_nsec: nanoseconds,
        };
        // A signal may end it early: the caller asks again anyway.
        let _ = poll(&mut [PollFd::new(&self.master, PollFlags::IN)], Some(&limit));
    }

    /// Up to `buffer.len()` characters that the client has sent.
    pub fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        match rustix::io::read(&self.master, buffer) {
            Ok(count) => {
                self.attached = true;
                Ok(count)
            }
            Err(Errno::AGAIN | Errno::INTR) => {
                self.attached = true;
                Ok(0)
            }
            // What Linux says while nobody has the other end open.
            Err(Errno::IO) => {
                self.attached = false;
                Ok(0)
            }
            Err(error) => {
                Err(error).with_context(|| format!("cannot read {}", self.path.display()))
            }
        }
    }

    /// Send to the client; how many characters it took. Without a client they are gone, as on a wire.
    pub fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        if !self.attached {
            return Ok(bytes.len());
        }
        match rustix::io::write(&self.master, bytes) {
            Ok(count) => Ok(count),
            Err(Errno::AGAIN | Errno::INTR) => Ok(0),
            Err(Errno::IO) => Ok(bytes.len()),
            Err(error) => {
                Err(error).with_context(|| format!("cannot write to {}", self.path.display()))
            }
        }
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        // Somebody else's link stays.
        if let Some(link) = &self.link
            && fs::read_link(link).is_ok_and(|target| target == self.path)
        {
            let _ = fs::remove_file(link);
        }
    }
}

/// No echo and no translation, before any client can notice that there was some. Opening and closing
/// the client's end once also lets the master tell from then on whether somebody has it open.
fn make_raw(path: &Path) -> io::Result<()> {
    let slave = rustix::fs::open(path, OFlags::RDWR | OFlags::NOCTTY, Mode::empty())?;
    let mut settings = tcgetattr(&slave)?;
    settings.make_raw();
    tcsetattr(&slave, OptionalActions::Now, &settings)?;
    tcflush(&slave, QueueSelector::IOFlush)?;
    Ok(())
}

fn put_link(path: &Path, link: &Path) -> Result<()> {
    match fs::symlink_metadata(link) {
        Ok(found) if found.is_symlink() => {
            fs::remove_file(link).with_context(|| format!("cannot replace {}", link.display()))?;
        }
        Ok(_) => bail!("{} is there and not a link; name another place", link.display()),
        Err(_) => {}
    }
    std::os::unix::fs::symlink(path, link)
        .with_context(|| format!("cannot link {} to {}", link.display(), path.display()))
}
