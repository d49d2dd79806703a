//! Writing a program into a base through its resident loader.

use std::io;
use std::time::Duration;

use common_sys::constants as c;
use common_sys::link::crc32;
use common_sys::loader::{BaseImage, Frame, Hello, Receiver, base_image_encode, hello_decode};

use crate::line::Line;
use crate::program::Program;

const BLOCK: usize = c::LOADER_BLOCK_SIZE as usize;
/// Block of a bank in which the program begins; before it lies the header.
const FIRST_BLOCK: usize = (c::BASE_IMAGE_PROGRAM_AT / c::LOADER_BLOCK_SIZE) as usize;
const SECTOR_BLOCKS: usize = (c::BOARD_IMAGE_SECTOR_SIZE / c::LOADER_BLOCK_SIZE) as usize;
/// Rates at which a program may be listening.
const CONSOLE_RATES: [u32; 2] = [c::BOARD_BAUD, 38400];
/// How often a request is sent before it is given up.
const TRIES: u32 = 8;
/// How often that time is doubled when no reply comes.
const PATIENCE_MAX: u32 = 4;
/// How long a reply may take beyond its time on the wire.
const SOON: Duration = Duration::from_millis(250);
const COMMIT_TIME: Duration = Duration::from_millis(1500);
/// An erase takes a second, seldom more; a lost reply must not cost the longest.
const ERASE_TIME: Duration = Duration::from_millis(2500);
/// From the command to the loader's first answer: a watchdog's time, and the image's check.
const ENTER_TIME: Duration = Duration::from_millis(2500);
const KNOCK_PERIOD: Duration = Duration::from_millis(40);

/// How to flash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Rate for the transfer; the line comes and goes at 9600.
    pub baud: u32,
    /// Write even what the base already has.
    pub force: bool,
    /// Only find out what there is to do.
    pub dry_run: bool,
    /// How long to knock at a base whose program does not listen, for somebody to switch it off and on.
    pub wait: Duration,
}

impl Default for Options {
    fn default() -> Self {
        Self { baud: 115_200, force: false, dry_run: false, wait: Duration::ZERO }
    }
}

/// What was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// The base has the program already, whole and active: nothing was written.
    pub unchanged: bool,
    /// Blocks of 256 bytes sent over the line.
    pub sent: usize,
    /// Blocks that the base copied from the program it had.
    pub copied: usize,
    /// Blocks that an interrupted attempt had left in place.
    pub kept: usize,
    /// Sectors erased.
    pub erased: usize,
    /// Requests that had to be repeated.
    pub repeated: u32,
    /// Generation of the image that is active now.
    pub generation: u32,
}

/// What is being done, for whoever watches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Looking for the loader.
    Entering,
    /// Nobody answers; knocking until the base is switched on.
    Knocking,
    /// So many of so many blocks are compared.
    Comparing(usize, usize),
    /// So many of so many sectors are erased.
    Erasing(usize, usize),
    /// So many of so many blocks are in place.
    Writing(usize, usize),
    /// The base sums up what it has, and makes it valid.
    Committing,
}

/// Why a base could not be flashed. Its old program is still there and starts at the next power-on.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The line failed.
    #[error("the serial line failed: {0}; check the cable, the base keeps its program")]
    Line(#[from] io::Error),
    /// No loader.
    #[error(
        "no loader answers; is the base switched on, at the right port? If its program does not listen, \
         run this with --wait 30 and switch the base off and on meanwhile"
    )]
    Silent,
    /// It stopped answering.
    #[error(
        "the loader stopped answering ({what}); the base keeps its program, run the same command again: \
         it goes on where it was"
    )]
    Lost {
        /// What it was asked for.
        what: &'static str,
    },
    /// It refused.
    #[error("the loader refuses ({what}): {why}")]
    Refused {
        /// What it was asked for.
        what: &'static str,
        /// What it says.
        why: &'static str,
    },
    /// It speaks another version.
    #[error("the loader speaks version {0} of the protocol, this program {version}; use the sot of its age",
        version = c::LOADER_PROTOCOL)]
    Version(u8),
    /// The caller wanted an end.
    #[error("interrupted; the base keeps its program")]
    Interrupted,
}

fn status_in_words(status: u8) -> &'static str {
    match u32::from(status) {
        c::LOADER_UNKNOWN => "it does not know the request; its version is older",
        c::LOADER_BAD_SIZE => "the request has the wrong length; report this",
        c::LOADER_OUT_OF_RANGE => "there is no such place; report this",
        c::LOADER_FLASH_FAILED => {
            "the flash does not take it; try again, else the chip is worn out"
        }
        c::LOADER_NOT_ACTIVE => "it has no program to copy from; report this",
        c::LOADER_BAD_HEADER => "the image does not fit this base; check how it was linked",
        c::LOADER_BAD_IMAGE => "what it read back differs from what was sent; run it again",
        _ => "it gives no reason",
    }
}

/// Told what goes on; false = stop.
pub type Watch<'a> = dyn FnMut(Step) -> bool + 'a;

/// Bring the base at the other end of `line` to run `program`, which is verified by reading it back.
/// The line comes in at 9600 baud and is left so.
///
/// # Errors
/// See [`Error`].
pub fn flash(
    line: &mut dyn Line,
    program: &Program,
    options: &Options,
    watch: &mut Watch<'_>,
) -> Result<Outcome, Error> {
    let mut client =
        Client { line, receiver: Receiver::default(), sequence: 0, repeated: 0, watch };
    let hello = client.enter(options)?;
    if u32::from(hello.protocol) != c::LOADER_PROTOCOL {
        return Err(Error::Version(hello.protocol));
    }
    let result = client.bring(program, options, &hello);
    // Whatever came of it, the base shall run what it has.
    let left = client.leave();
    let outcome = result?;
    left?;
    Ok(Outcome { repeated: client.repeated, ..outcome })
}

/// What is to be done with a block of the bank.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Work {
    Nothing,
    Copy,
    Send,
}

/// The way from what the bank holds to what it shall hold.
struct Plan {
    /// Sectors to erase.
    sectors: Vec<u8>,
    /// For each block of the program, in its order.
    blocks: Vec<Work>,
}

struct Client<'a> {
    line: &'a mut dyn Line,
    receiver: Receiver,
    sequence: u8,
    repeated: u32,
    watch: &'a mut Watch<'a>,
}

impl Client<'_> {
    fn show(&mut self, step: Step) -> Result<(), Error> {
        if (self.watch)(step) { Ok(()) } else { Err(Error::Interrupted) }
    }

    // ---- requests

    /// The next whole frame within `limit`.
    fn frame(&mut self, limit: Duration) -> Result<Option<Frame>, Error> {
        let end = self.line.now() + limit;
        loop {
            // A babbling line must not keep us here.
            let left = end.saturating_sub(self.line.now());
            let bytes = if left.is_zero() { vec![] } else { self.line.receive(left)? };
            if bytes.is_empty() {
                return Ok(None);
            }
            // What comes after a whole frame belongs to nobody: one request, one reply.
            let frame = bytes.iter().find_map(|&byte| self.receiver.take(byte));
            if frame.is_some() {
                return Ok(frame);
            }
        }
    }

    fn send(&mut self, kind: u32, payload: &[u8]) -> Result<(), Error> {
        let frame = Frame { kind: kind as u8, sequence: self.sequence, payload: payload.to_vec() };
        Ok(self.line.send(&frame.encode())?)
    }

    /// A reply to the request of this kind, its status and the rest, if one comes in time.
    fn reply(&mut self, kind: u32, limit: Duration) -> Result<Option<(u8, Vec<u8>)>, Error> {
        let wanted = (kind | c::LOADER_REPLY) as u8;
        while let Some(frame) = self.frame(limit)? {
            if frame.kind == wanted
                && frame.sequence == self.sequence
                && let Some((&status, rest)) = frame.payload.split_first()
            {
                return Ok(Some((status, rest.to_vec())));
            }
        }
        Ok(None)
    }

    /// Ask until there is a reply; None: there is none.
    fn try_request(
        &mut self,
        kind: u32,
        payload: &[u8],
        limit: Duration,
        tries: u32,
    ) -> Result<Option<(u8, Vec<u8>)>, Error> {
        self.sequence = self.sequence.wrapping_add(1);
        for attempt in 0..tries {
            if attempt > 0 {
                self.repeated += 1;
            }
            self.send(kind, payload)?;
            // More patience each time: a twin on a busy machine may only be slow.
            let limit = limit * (1 << attempt.min(PATIENCE_MAX));
            if let Some(reply) = self.reply(kind, limit)? {
                return Ok(Some(reply));
            }
        }
        Ok(None)
    }

    fn request(
        &mut self,
        what: &'static str,
        kind: u32,
        payload: &[u8],
        limit: Duration,
    ) -> Result<Vec<u8>, Error> {
        match self.try_request(kind, payload, limit, TRIES)? {
            Some((0, rest)) => Ok(rest),
            Some((status, _)) => Err(Error::Refused { what, why: status_in_words(status) }),
            None => Err(Error::Lost { what }),
        }
    }

    // ---- in and out

    fn hello(&mut self, limit: Duration) -> Result<Option<Hello>, Error> {
        let reply = self.try_request(c::LOADER_HELLO, &[], limit, 1)?;
        Ok(reply.and_then(|(_, rest)| hello_decode(&rest)))
    }

    fn enter(&mut self, options: &Options) -> Result<Hello, Error> {
        self.show(Step::Entering)?;
        for baud in CONSOLE_RATES {
            self.line.set_baud(baud)?;
            if let Some(hello) = self.hello(SOON)? {
                return Ok(hello);
            }
            // Whatever was half typed ends here.
            self.line.send(b"\r\nloader\r\n")?;
            self.line.set_baud(c::BOARD_BAUD)?;
            let turns = ENTER_TIME.as_millis() / SOON.as_millis() / CONSOLE_RATES.len() as u128;
            for _ in 0..turns {
                if let Some(hello) = self.hello(SOON)? {
                    return Ok(hello);
                }
            }
        }
        self.knock(options.wait)
    }

    /// A HELLO that comes while the loader checks the program keeps it there. Knocks come faster than an
    /// answer crosses the line, so the answer to an earlier one is as good.
    fn knock(&mut self, wait: Duration) -> Result<Hello, Error> {
        let answer = (c::LOADER_HELLO | c::LOADER_REPLY) as u8;
        for _ in 0..wait.as_millis() / KNOCK_PERIOD.as_millis() {
            self.show(Step::Knocking)?;
            self.sequence = self.sequence.wrapping_add(1);
            self.send(c::LOADER_HELLO, &[])?;
            if let Some(frame) = self.frame(KNOCK_PERIOD)?
                && frame.kind == answer
                && let Some((0, rest)) = frame.payload.split_first()
                && let Some(hello) = hello_decode(rest)
            {
                return Ok(hello);
            }
        }
        Err(Error::Silent)
    }

    /// A faster line, if both ends manage; else it stays as it is.
    fn speed_up(&mut self, baud: u32) -> Result<(), Error> {
        if baud == c::BOARD_BAUD {
            return Ok(());
        }
        let wire = baud.to_be_bytes();
        match self.try_request(c::LOADER_SPEED, &wire, SOON, TRIES)? {
            Some((0, _)) => {}
            _ => return Ok(()),
        }
        self.line.set_baud(baud)?;
        if self.try_request(c::LOADER_HELLO, &[], SOON, 4)?.is_none() {
            // The loader comes back by itself after 1.5 s without a good frame.
            self.line.set_baud(c::BOARD_BAUD)?;
            self.request("going back to 9600 baud", c::LOADER_HELLO, &[], SOON * 2)?;
        }
        Ok(())
    }

    /// Start the program. No answer may mean that it is starting already.
    fn leave(&mut self) -> Result<(), Error> {
        self.try_request(c::LOADER_RUN, &[], SOON, 3)?;
        Ok(self.line.set_baud(c::BOARD_BAUD)?)
    }

    // ---- the job

    fn bring(
        &mut self,
        program: &Program,
        options: &Options,
        hello: &Hello,
    ) -> Result<Outcome, Error> {
        let here = hello.length as usize == program.bytes.len() && hello.crc32 == program.crc32();
        let active = u32::from(hello.active) != c::LOADER_NO_BANK;
        let outcome = Outcome { generation: hello.generation, ..Outcome::default() };
        if here && active && !options.force {
            return Ok(Outcome { unchanged: true, ..outcome });
        }
        self.speed_up(options.baud)?;
        let wanted = blocks_of(program);
        let plan = self.plan(&wanted, hello)?;
        let count = |work| plan.blocks.iter().filter(|&&one| one == work).count();
        let outcome = Outcome {
            sent: count(Work::Send),
            copied: count(Work::Copy),
            kept: count(Work::Nothing),
            erased: plan.sectors.len(),
            ..outcome
        };
        if options.dry_run {
            return Ok(outcome);
        }
        self.write(&plan, &wanted)?;
        self.commit(program, hello.generation.wrapping_add(1))?;
        Ok(Outcome { generation: hello.generation.wrapping_add(1), ..outcome })
    }

    fn sums(&mut self, bank: u8, first: usize, count: usize) -> Result<Vec<u32>, Error> {
        let mut sums = Vec::with_capacity(count);
        while sums.len() < count {
            let piece = (count - sums.len()).min(c::LOADER_SUMS_MAX as usize);
            let [high, low] = ((first + sums.len()) as u16).to_be_bytes();
            let payload = [bank, high, low, piece as u8];
            let reply = self.request("comparing", c::LOADER_SUMS, &payload, SOON * 2)?;
            if reply.len() != 4 * piece {
                return Err(Error::Lost { what: "comparing" });
            }
            let words = reply.chunks_exact(4);
            sums.extend(words.map(|b| u32::from_be_bytes([b[0], b[1], b[2], b[3]])));
        }
        Ok(sums)
    }

    fn plan(&mut self, wanted: &[[u8; BLOCK]], hello: &Hello) -> Result<Plan, Error> {
        let all = FIRST_BLOCK + wanted.len();
        self.show(Step::Comparing(0, 2 * all))?;
        let target = u8::from(hello.active == 0);
        let there = self.sums(target, 0, all)?;
        self.show(Step::Comparing(all, 2 * all))?;
        let active = match u32::from(hello.active) == c::LOADER_NO_BANK {
            true => vec![],
            false => self.sums(hello.active, FIRST_BLOCK, wanted.len())?,
        };
        self.show(Step::Comparing(2 * all, 2 * all))?;

        let blank = crc32(&[0xFF; BLOCK]);
        let wanted: Vec<u32> = wanted.iter().map(|block| crc32(block)).collect();
        // The header's block has to be erased: an old one must go before the program behind it does.
        let fits = |block: usize| {
            let goal = if block < FIRST_BLOCK { blank } else { wanted[block - FIRST_BLOCK] };
            there[block] == blank || there[block] == goal
        };
        let in_sector =
            |sector: usize| sector * SECTOR_BLOCKS..all.min((sector + 1) * SECTOR_BLOCKS);
        let erase: Vec<bool> =
            (0..all.div_ceil(SECTOR_BLOCKS)).map(|s| !in_sector(s).all(fits)).collect();
        let work = |index: usize| {
            let block = FIRST_BLOCK + index;
            let now = if erase[block / SECTOR_BLOCKS] { blank } else { there[block] };
            match active.get(index) {
                _ if now == wanted[index] => Work::Nothing,
                Some(&sum) if sum == wanted[index] => Work::Copy,
                _ => Work::Send,
            }
        };
        Ok(Plan {
            blocks: (0..wanted.len()).map(work).collect(),
            sectors: (0..).zip(&erase).filter(|(_, erase)| **erase).map(|(s, _)| s).collect(),
        })
    }

    fn write(&mut self, plan: &Plan, wanted: &[[u8; BLOCK]]) -> Result<(), Error> {
        // The sector with the header first: from then on the bank is known not to be whole.
        for (done, &sector) in plan.sectors.iter().enumerate() {
            self.show(Step::Erasing(done, plan.sectors.len()))?;
            self.request("erasing", c::LOADER_ERASE, &[sector], ERASE_TIME)?;
        }
        for (index, work) in plan.blocks.iter().enumerate() {
            self.show(Step::Writing(index, plan.blocks.len()))?;
            let block = ((FIRST_BLOCK + index) as u16).to_be_bytes();
            match work {
                Work::Nothing => {}
                Work::Copy => {
                    self.request("copying", c::LOADER_COPY, &block, SOON)?;
                }
                Work::Send => {
                    let payload = [&block[..], &wanted[index]].concat();
                    self.request("writing", c::LOADER_WRITE, &payload, 2 * SOON)?;
                }
            }
        }
        self.show(Step::Writing(plan.blocks.len(), plan.blocks.len()))
    }

    fn commit(&mut self, program: &Program, generation: u32) -> Result<(), Error> {
        self.show(Step::Committing)?;
        let header = base_image_encode(&BaseImage {
            length: program.bytes.len() as u32,
            load: program.load,
            entry: program.entry,
            crc32: program.crc32(),
            generation,
            build: program.build,
        });
        self.request("verifying", c::LOADER_COMMIT, &header, COMMIT_TIME)?;
        Ok(())
    }
}

/// The program in blocks, the last one filled up as erased flash.
fn blocks_of(program: &Program) -> Vec<[u8; BLOCK]> {
    let block = |piece: &[u8]| {
        let mut block = [0xFF; BLOCK];
        block[..piece.len()].copy_from_slice(piece);
        block
    };
    program.bytes.chunks(BLOCK).map(block).collect()
}
