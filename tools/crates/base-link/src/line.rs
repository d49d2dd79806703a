//! A serial line, 8N1, at whose other end a base listens.

use std::io;
use std::path::Path;
use std::time::{Duration, Instant};

use serialport::{ClearBuffer, FlowControl, SerialPort, TTYPort};

/// A serial line. Times are those of the line: simulated ones, if it is.
pub trait Line {
    /// Send all of `bytes`.
    ///
    /// # Errors
    /// What the system says.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// What has come, after waiting at most `limit` for the first of it; empty if nothing came.
    ///
    /// # Errors
    /// What the system says.
    fn receive(&mut self, limit: Duration) -> io::Result<Vec<u8>>;

    /// Change this end's rate, once all is sent.
    ///
    /// # Errors
    /// What the system says.
    fn set_baud(&mut self, baud: u32) -> io::Result<()>;

    /// Time on the line's clock, from some beginning of its own.
    fn now(&self) -> Duration;
}

/// A serial port of this machine, or the pseudo-terminal of a twin.
pub struct SerialLine {
    name: String,
    port: TTYPort,
    opened: Instant,
}

// Linux' numbers: no such device (any more).
const EIO: i32 = 5;
const ENXIO: i32 = 6;
const ENODEV: i32 = 19;
/// What is read at a time.
const BUFFER: usize = 4096;

impl SerialLine {
    /// Opens the port for this program alone.
    ///
    /// # Errors
    /// What the system says, in words that tell what to do about it.
    pub fn open(path: &Path, baud: u32) -> Result<Self, OpenError> {
        let name = path.display().to_string();
        // What `serialport` says of a missing device is not worth reading.
        path.metadata().map_err(|source| OpenError::Missing { name: name.clone(), source })?;
        let mut port = TTYPort::open(&serialport::new(name.as_str(), baud)).map_err(|error| {
            let text = error.to_string();
            if text.contains("ermission") {
                OpenError::Forbidden { name: name.clone() }
            } else {
                OpenError::Other { name: name.clone(), text }
            }
        })?;
        // The lock ends with the port, even where the system keeps the device alive (a pseudo-terminal).
        let _ = port.set_exclusive(true);
        // Whoever had the line before may have left it otherwise.
        let _ = port.set_flow_control(FlowControl::None);
        let _ = port.clear(ClearBuffer::Input);
        Ok(Self { name, port, opened: Instant::now() })
    }

    /// Obey XON and XOFF, or take them for characters as the loader's frames want it (as when opened).
    ///
    /// # Errors
    /// What the system says.
    pub fn flow_control(&mut self, on: bool) -> io::Result<()> {
        let how = if on { FlowControl::Software } else { FlowControl::None };
        self.port.set_flow_control(how).map_err(io::Error::from)
    }

    /// Another handle for the same port, for a second thread.
    ///
    /// # Errors
    /// What the system says.
    pub fn try_clone(&self) -> io::Result<Self> {
        let port = self.port.try_clone_native().map_err(io::Error::from)?;
        Ok(Self { name: self.name.clone(), port, opened: self.opened })
    }
}

impl SerialLine {
    /// What the system says when the other end goes, in words that tell what that means.
    fn or_closed(&self, error: io::Error) -> io::Error {
        // EIO and ENXIO have no kind of their own.
        let gone = error.kind() == io::ErrorKind::BrokenPipe
            || error.raw_os_error().is_some_and(|code| [EIO, ENXIO, ENODEV].contains(&code));
        if !gone {
            return error;
        }
        let text = format!("{} was closed; was the cable pulled, or did the twin end?", self.name);
        io::Error::new(io::ErrorKind::BrokenPipe, text)
    }
}

impl Drop for SerialLine {
    fn drop(&mut self) {
        let _ = self.port.set_exclusive(false);
    }
}

/// Why a serial port cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// It is not there.
    #[error("cannot open {name} ({source}); is the cable plugged in, or the twin running?")]
    Missing {
        /// The device.
        name: String,
        /// What the system says.
        source: io::Error,
    },
    /// Not for this user.
    #[error(
        "no permission for {name}; join the group that owns it (usually: sudo adduser $USER dialout) \
         and log in again"
    )]
    Forbidden {
        /// The device.
        name: String,
    },
    /// Anything else.
    #[error("cannot open {name}: {text}; does another program have it open?")]
    Other {
        /// The device.
        name: String,
        /// What the system says.
        text: String,
    },
}

fn is_nothing(error: &io::Error) -> bool {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), TimedOut | WouldBlock | Interrupted)
}

impl Line for SerialLine {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        use std::io::Write;
        self.port.set_timeout(Duration::from_secs(10)).map_err(io::Error::from)?;
        let sent = self.port.write_all(bytes).and_then(|()| self.port.flush());
        sent.map_err(|error| self.or_closed(error))
    }

    fn receive(&mut self, limit: Duration) -> io::Result<Vec<u8>> {
        use std::io::Read;
        let end = Instant::now() + limit;
        let mut buffer = vec![0; BUFFER];
        loop {
            let left = end.saturating_duration_since(Instant::now()).max(Duration::from_millis(1));
            self.port.set_timeout(left).map_err(io::Error::from)?;
            match self.port.read(&mut buffer) {
                Ok(0) => return Err(self.or_closed(io::ErrorKind::BrokenPipe.into())),
                Ok(count) => {
                    buffer.truncate(count);
                    return Ok(buffer);
                }
                Err(error) if is_nothing(&error) => {}
                Err(error) => return Err(self.or_closed(error)),
            }
            if Instant::now() >= end {
                return Ok(Vec::new());
            }
        }
    }

    fn set_baud(&mut self, baud: u32) -> io::Result<()> {
        self.port.set_baud_rate(baud).map_err(io::Error::from)
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }
}
