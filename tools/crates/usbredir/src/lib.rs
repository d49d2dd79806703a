//! Serves an emulated USB device to QEMU (or any other usbredir client) over TCP, so that a real
//! kernel's drivers talk to it:
//!
//! ```text
//! qemu-system-x86_64 -device qemu-xhci,id=hc \
//!   -chardev socket,id=ur,host=127.0.0.1,port=4000 -device usb-redir,chardev=ur,bus=hc.0
//! ```
//!
//! [`client`] is the other side, for programs that use such a device without a kernel in between.
//!
//! [`protocol`] turns bytes into packets, [`session`] packets into transfers on the emulated bus;
//! [`serve`] adds the socket and paces simulated time to the wall clock.

pub mod client;
mod isochronous;
mod kept;
pub mod protocol;
pub mod session;

pub use session::{Event, Session, SessionError};

use fx2::host::Link;
use sim::{MS, Ps, US};
use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Simulated time between two looks at the socket, with and without transfers under way.
const BUSY_SLICE: Ps = 250 * US;
const IDLE_SLICE: Ps = MS;
/// If simulated time falls back more than this, it is not made up for.
const LAG_MAX: Ps = 100 * MS;
/// A peer that does not take its answers is dropped when so many bytes wait.
const OUTGOING_MAX: usize = 64 << 20;
/// Bytes taken from a peer between two slices, and bytes of its transfers that may wait for the device.
const READ_MAX: usize = 1 << 20;
const BACKLOG_MAX: usize = 64 << 20;
/// Real time within which a peer must have said hello.
const HELLO_TIMEOUT: Duration = Duration::from_secs(5);

/// What happens while serving.
#[derive(Debug)]
pub enum Notice {
    /// A peer has connected.
    PeerConnected(SocketAddr),
    /// It has gone, by itself or with an error of its own.
    PeerGone(Option<String>),
    /// The device came or went in the peer's eyes.
    Device(Event),
}

/// How to serve.
#[derive(Clone, Copy, Debug)]
pub struct Options<'a> {
    /// Ends after so much simulated time; `None` = never.
    pub duration: Option<Ps>,
    /// The bus grants high speed.
    pub high_speed: bool,
    /// Ends soon after this has turned true.
    pub stop: Option<&'a AtomicBool>,
}

impl Default for Options<'_> {
    /// High speed, without end.
    fn default() -> Self {
        Self { duration: None, high_speed: true, stop: None }
    }
}

/// Runs the device in the pace of the wall clock and serves one peer after another. A peer may vanish
/// at any moment.
///
/// # Errors
/// If the listening socket fails.
pub fn serve(
    listener: &TcpListener,
    link: &mut impl Link,
    options: Options<'_>,
    mut notice: impl FnMut(Notice),
) -> io::Result<()> {
    listener.set_nonblocking(true)?;
    let end = options.duration.map_or(Ps::MAX, |time| link.fx2().now().saturating_add(time));
    let mut pace = Pace::new(link.fx2().now());
    let mut peer: Option<Peer> = None;
    let stopped = || options.stop.is_some_and(|stop| stop.load(Ordering::Relaxed));
    while link.fx2().now() < end && !stopped() {
        if peer.is_none() {
            peer = Peer::accept(listener, options.high_speed, &mut notice)?;
        }
        let busy = peer.as_ref().is_some_and(|peer| peer.session.is_busy());
        let slice = if busy { BUSY_SLICE } else { IDLE_SLICE };
        let until = (link.fx2().now() + slice).min(end);
        match &mut peer {
            None => link.run_until(until),
            Some(active) => {
                let outcome = active.exchange(link, until);
                for event in active.session.take_events() {
                    notice(Notice::Device(event));
                }
                if let Err(reason) = outcome {
                    active.session.close(link);
                    notice(Notice::PeerGone(reason));
                    peer = None;
                }
            }
        }
        pace.wait(link.fx2().now());
    }
    Ok(())
}

/// A connected client.
struct Peer {
    stream: TcpStream,
    session: Session,
    since: Instant,
}

impl Peer {
    fn accept(
        listener: &TcpListener,
        high_speed: bool,
        notice: &mut impl FnMut(Notice),
    ) -> io::Result<Option<Self>> {
        match listener.accept() {
            Ok((stream, address)) => {
                stream.set_nonblocking(true)?;
                stream.set_nodelay(true)?;
                notice(Notice::PeerConnected(address));
                let session = Session::new(high_speed);
                Ok(Some(Self { stream, session, since: Instant::now() }))
            }
            // A client that is gone again before it is accepted is no reason to stop.
            Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(None),
            Err(error) if error.kind() == ErrorKind::ConnectionAborted => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Takes what came, runs until `until`, sends answers. The error is why the peer is gone.
    fn exchange(&mut self, link: &mut impl Link, until: Ps) -> Result<(), Option<String>> {
        self.read().map_err(reason)?;
        self.session.run_until(link, until).map_err(|error| Some(error.to_string()))?;
        self.write().map_err(reason)?;
        if self.session.outgoing().len() > OUTGOING_MAX {
            return Err(Some("the peer does not take its answers".into()));
        }
        if !self.session.is_greeted() && self.since.elapsed() > HELLO_TIMEOUT {
            return Err(Some("the peer did not say hello; is it a usbredir client?".into()));
        }
        Ok(())
    }

    /// Takes what is there, within limits: the rest waits in the system's buffers.
    fn read(&mut self) -> io::Result<()> {
        let mut buffer = [0; 65536];
        let mut taken = 0;
        loop {
            if taken >= READ_MAX || self.session.backlog() > BACKLOG_MAX {
                return Ok(());
            }
            match self.stream.read(&mut buffer) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(count) => {
                    self.session.receive(&buffer[..count]);
                    taken += count;
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }

    fn write(&mut self) -> io::Result<()> {
        let outgoing = self.session.outgoing();
        while !outgoing.is_empty() {
            match self.stream.write(outgoing) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(count) => drop(outgoing.drain(..count)),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

/// A peer that closes its end leaves without an error.
fn reason(error: io::Error) -> Option<String> {
    (error.kind() != ErrorKind::UnexpectedEof).then(|| error.to_string())
}

/// Holds simulated time back to the wall clock.
struct Pace {
    wall: Instant,
    simulated: Ps,
}

impl Pace {
    fn new(now: Ps) -> Self {
        Self { wall: Instant::now(), simulated: now }
    }

    fn wait(&mut self, now: Ps) {
        let target = Duration::from_nanos((now - self.simulated) / 1000);
        let passed = self.wall.elapsed();
        std::thread::sleep(target.saturating_sub(passed));
        let lag = passed.saturating_sub(target);
        if lag > Duration::from_nanos(LAG_MAX / 1000) {
            *self = Self::new(now);
        }
    }
}
