//! A PC that receives the turret's stream, in simulated time: as `sot stream` does it, without a cable.
//!
//! It checks what it gets on the fly ([`stream::Checker`]) and keeps nothing.

use common_sys::constants as c;
use fx2::host::{Host, HostError, Link, Request};
use rand_core::Rng;
use sim::{MS, Ps, SECOND, US, device_rng};
use stream::{Checker, Damage, Findings, Parser, Record};
use thiserror::Error;

/// The endpoint, without its direction bit.
const ENDPOINT: u8 = c::USB_BULK_IN as u8 & 0x0F;
/// A host asks an endpoint without data again after so long.
const POLL: Ps = 20 * US;
/// The end record comes within this, even of a full frame memory.
const END_BUDGET: Ps = 2 * SECOND;
/// Simulated seconds in which a pausing client is at work, and in which it sleeps, at most.
const PAUSE_MAX: Ps = 400 * MS;

/// What is streamed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// 640x480 instead of 320x240.
    pub large: bool,
    /// The test pattern instead of the cameras.
    pub pattern: bool,
    /// Frames a second.
    pub rate: u16,
}

/// Why a stream could not be received.
#[derive(Debug, Error)]
pub enum Error {
    /// USB.
    #[error(transparent)]
    Host(#[from] HostError),
    /// What came is no stream.
    #[error(transparent)]
    Damage(#[from] Damage),
    /// The turret does not end it.
    #[error("no end record within {0} ms")]
    NoEnd(u64),
}

/// What was received, besides what the checker has found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Bytes in packets.
    pub bytes: u64,
    /// Of them, pixels and headers of whole frames.
    pub frames: u64,
    /// From the last packet of a pair back to the end of its exposure: sum and longest.
    pub latency_sum: Ps,
    /// See [`Counts::latency_sum`].
    pub latency_max: Ps,
    /// Pairs from the cameras, of which the two above tell.
    pub pairs: u64,
}

/// The PC.
pub struct Receiver {
    /// Its host controller.
    pub host: Host,
    parser: Parser,
    checker: Checker,
    /// What it has counted.
    pub counts: Counts,
    ended: bool,
    /// From the design's time, in which a header tells the exposure, to the simulation's.
    started: Ps,
}

fn vendor_out(number: u32, value: u16, index: u16) -> Request {
    Request { kind: 0x40, request: number as u8, value, index }
}

impl Receiver {
    /// A PC that has enumerated the turret with `host`.
    pub fn new(host: Host) -> Self {
        Self {
            host,
            parser: Parser::default(),
            checker: Checker::default(),
            counts: Counts::default(),
            ended: false,
            started: 0,
        }
    }

    /// Write an FPGA register through the firmware.
    ///
    /// # Errors
    /// If the turret does not take it.
    pub fn set(&mut self, link: &mut impl Link, register: u32, value: u16) -> Result<(), Error> {
        let request = vendor_out(c::REQUEST_FPGA_REGISTER, value, register as u16);
        Ok(self.host.control_out(link, request, &[])?)
    }

    /// Read one.
    ///
    /// # Errors
    /// If the turret does not tell.
    pub fn get(&mut self, link: &mut impl Link, register: u32) -> Result<u16, Error> {
        let request =
            Request { kind: 0xC0, ..vendor_out(c::REQUEST_FPGA_REGISTER, 0, register as u16) };
        let reply = self.host.control_in(link, request, 2)?;
        Ok(reply.try_into().map_or(u16::MAX, u16::from_be_bytes))
    }

    /// Choose an alternate setting of interface 0.
    ///
    /// # Errors
    /// If the turret refuses.
    pub fn choose(&mut self, link: &mut impl Link, alternate: u32) -> Result<(), Error> {
        let request = Request { kind: 0x01, request: 11, value: alternate as u16, index: 0 };
        self.host.control_out(link, request, &[])?;
        self.host.clear_toggles(ENDPOINT);
        Ok(())
    }

    /// Set both cameras up for a format, and begin a stream. One that is under way ends without its
    /// end record.
    ///
    /// # Errors
    /// If the turret refuses any of it.
    pub fn start(&mut self, link: &mut impl Link, settings: &Settings) -> Result<(), Error> {
        self.choose(link, c::USB_ALTERNATE_STREAM)?;
        self.parser = Parser::default();
        let format = u16::from(settings.large);
        if self.get(link, c::FPGA_REG_FORMAT)? != format {
            self.set(link, c::FPGA_REG_FORMAT, format)?;
            self.host.control_out(link, vendor_out(c::REQUEST_CAMERAS, 0, 0), &[])?;
        }
        self.set(link, c::FPGA_REG_SOURCE, u16::from(settings.pattern))?;
        self.set(link, c::FPGA_REG_FRAME_RATE, settings.rate)?;
        self.ended = false;
        self.set(link, c::FPGA_REG_STREAM, c::FPGA_STREAM_ON as u16)
    }

    /// From now on latencies are measured: `started` is when the FPGA's design came to life.
    pub fn measure_from(&mut self, started: Ps) {
        self.started = started;
    }

    /// Read for `duration`, or until the stream ends.
    ///
    /// # Errors
    /// If the bus or the stream is damaged.
    pub fn read_for(&mut self, link: &mut impl Link, duration: Ps) -> Result<(), Error> {
        let until = link.fx2().now() + duration;
        while link.fx2().now() < until && !self.ended {
            match self.host.try_bulk_in(link, ENDPOINT)? {
                Some(packet) => self.take(&packet, link.fx2().now())?,
                None => {
                    let next = link.fx2().now() + POLL;
                    link.run_until(next);
                }
            }
        }
        Ok(())
    }

    /// Read for `duration` like a program that is swapped out at random.
    ///
    /// # Errors
    /// As [`Receiver::read_for`].
    pub fn read_with_pauses(
        &mut self,
        link: &mut impl Link,
        duration: Ps,
        seed: u64,
    ) -> Result<(), Error> {
        let mut rng = device_rng(seed, "a client that pauses");
        let until = link.fx2().now() + duration;
        while link.fx2().now() < until {
            self.read_for(link, rng.next_u64() % PAUSE_MAX)?;
            let woken = link.fx2().now() + rng.next_u64() % PAUSE_MAX;
            link.run_until(woken);
        }
        Ok(())
    }

    fn take(&mut self, packet: &[u8], now: Ps) -> Result<(), Error> {
        self.counts.bytes += packet.len() as u64;
        self.parser.push(packet);
        while let Some((_, record)) = self.parser.next_record()? {
            match &record {
                Record::End(_) => self.ended = true,
                Record::Frame(frame) => {
                    self.counts.frames += 1;
                    let header = &frame.header;
                    let cameras = !frame.has(c::STREAM_FLAG_PATTERN);
                    if u32::from(header.eye) == c::STREAM_EYE_RIGHT && cameras {
                        let large = header.width_px > common_sys::vision::WIDTH as u16;
                        self.latency(header.exposure_us, large, now);
                    }
                }
            }
            self.checker.take(record);
        }
        Ok(())
    }

    fn latency(&mut self, exposure_us: u32, large: bool, now: Ps) {
        let read_out =
            if large { c::CAMERA_EXPOSURE_TO_END_LARGE_US } else { c::CAMERA_EXPOSURE_TO_END_US };
        let last_pixel = self.started + (Ps::from(exposure_us) + Ps::from(read_out)) * US;
        let latency = now.saturating_sub(last_pixel);
        self.counts.pairs += 1;
        self.counts.latency_sum += latency;
        self.counts.latency_max = self.counts.latency_max.max(latency);
    }

    /// End the stream, and read on to its end record.
    ///
    /// # Errors
    /// If it does not come.
    pub fn stop(&mut self, link: &mut impl Link) -> Result<(), Error> {
        self.set(link, c::FPGA_REG_STREAM, c::FPGA_STREAM_END as u16)?;
        self.read_for(link, END_BUDGET)?;
        if !self.ended {
            return Err(Error::NoEnd(END_BUDGET / MS));
        }
        Ok(())
    }

    /// What was found until now.
    pub fn findings(&self) -> &Findings {
        self.checker.findings()
    }

    /// What was found in all.
    pub fn finish(self) -> Findings {
        self.checker.finish()
    }
}
