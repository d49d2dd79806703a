//! What the turret's firmware can be asked for; docs/SPEC.md section 4 has the grammar.

use std::ops::Range;
use std::time::{Duration, Instant};

use common_sys::constants as c;
use common_sys::link::{
    CONFIG_STATUS_SIZE, ConfigStatus, EEPROM_SERIAL_SIZE, STORE_STATUS_SIZE, SlotHeader,
    StoreStatus, config_status_decode, crc32, eeprom_serial_decode, slot_header_encode,
    store_status_decode,
};
use thiserror::Error;
use virtex::store::{Slot, State, TAIL_SIZE, slot_of};

use crate::device::{Device, LinkError, Setup};
use crate::select::{self, SelectError, Selector};

const VENDOR_OUT: u8 = 0x40;
const VENDOR_IN: u8 = 0xC0;

/// For a configuration: the turret needs 50 ms.
const CONFIG_PATIENCE: Duration = Duration::from_secs(10);
/// For an erasure of all sectors of a slot, of up to 4 s each (M29W128FH), with a twin at a third of
/// its pace.
const STORE_PATIENCE: Duration = Duration::from_secs(60);
/// For a block of flash.
const READ_PATIENCE: Duration = Duration::from_secs(10);
/// Between two looks at a status.
const STATUS_PERIOD: Duration = Duration::from_millis(2);
/// Bytes written between two steps of a progress bar.
const WRITE_PIECE: usize = 8 << 10;
/// Size of the reads, and how many are under way.
const READ_SIZE: usize = 16 << 10;
const READS: usize = 8;

const BLOCK: usize = c::STORE_BLOCK as usize;
const BULK_OUT: u8 = c::USB_BULK_OUT as u8;
const BULK_IN: u8 = c::USB_BULK_IN as u8;
const NO_SLOT: u8 = c::CONFIG_NO_SLOT as u8;

/// Why the turret did not do it.
#[derive(Debug, Error)]
pub enum TurretError {
    /// No turret was chosen.
    #[error(transparent)]
    Select(#[from] SelectError),
    /// The way to it is broken.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// It is something else.
    #[error(
        "{name} is {vendor:04x}:{product:04x}, not a turret: a blank one gets its firmware by \
         `sot flash eeprom FILE`"
    )]
    Stranger {
        /// What `--robot` calls it.
        name: String,
        /// idVendor.
        vendor: u16,
        /// idProduct.
        product: u16,
    },
    /// Its firmware is of another time.
    #[error(
        "{name}: its firmware speaks API level {found}, this program level {}; flash the firmware \
         that belongs to this program: `sot flash eeprom FILE`",
        c::USB_API_LEVEL
    )]
    ApiLevel {
        /// What `--robot` calls it.
        name: String,
        /// Its level.
        found: u16,
    },
    /// A status of another version.
    #[error("the turret's status is of a version that this program does not know")]
    Status,
    /// STALL to a request that may be refused for a reason.
    #[error("the turret refuses to {0}")]
    Refused(String),
    /// The FPGA's configuration failed.
    #[error("{0}")]
    Config(String),
    /// Work on the bitstream store failed.
    #[error("{0}")]
    Store(String),
    /// A job did not end.
    #[error("the turret is still busy after {0} s; `sot fpga status` shows with what")]
    Busy(u64),
    /// What was asked for is not in the slot.
    #[error("slot {slot} {why}")]
    Slot {
        /// 0..=31.
        slot: u8,
        /// What it is instead.
        why: &'static str,
    },
    /// What was read back differs.
    #[error("slot {slot} differs from what was written at byte {at}; write it again")]
    Differs {
        /// 0..=31.
        slot: u8,
        /// The first byte.
        at: usize,
    },
    /// Not all blocks have come.
    #[error("the turret ended a read after {got} of {wanted} bytes")]
    Short {
        /// Bytes that came.
        got: usize,
        /// Bytes asked for.
        wanted: usize,
    },
}

/// What a configuration's result means, with the cure if there is one.
pub fn config_result(result: u8) -> &'static str {
    match u32::from(result) {
        c::CONFIG_OK => "configured",
        c::CONFIG_BUSY => "busy",
        c::CONFIG_NO_FLASH => "the flash does not answer, or is of another kind",
        c::CONFIG_NO_DEFAULT => "no slot is marked as default: `sot fpga default SLOT`",
        c::CONFIG_BAD_SLOT => "the slot holds no whole bitstream",
        c::CONFIG_NO_INIT => "INIT# did not rise after PROG#: no FPGA, or no supply",
        c::CONFIG_CRC_ERROR => "CRC error: the FPGA found the bitstream damaged (INIT# fell)",
        c::CONFIG_NO_DONE => "DONE stayed low after the last byte: not a whole bitstream",
        c::CONFIG_BUS_STUCK => "the transfer from flash to FPGA did not end in its time",
        c::CONFIG_ABORTED => "aborted",
        c::CONFIG_NO_DATA => "the host stopped sending",
        c::CONFIG_TOO_LONG => "the host sent more than it had announced",
        _ => "a result that this program does not know",
    }
}

/// What a result of work on the store means, with the cure if there is one.
pub fn store_result(result: u8) -> &'static str {
    match u32::from(result) {
        c::STORE_OK => "done",
        c::STORE_BUSY => "busy",
        c::STORE_NO_FLASH => "the flash does not answer, or is of another kind",
        c::STORE_TIMEOUT => "the flash stayed busy for longer than its data sheet allows",
        c::STORE_ERASE_FAILED => "a sector is not erased after its erasure: the flash is worn",
        c::STORE_PROGRAM_FAILED => "what was programmed reads back differently: the flash is worn",
        c::STORE_ABORTED => "aborted",
        c::STORE_NO_DATA => "the host stopped sending",
        c::STORE_TOO_LONG => "the host sent more than it had announced",
        c::STORE_EMPTY_SLOT => "only a slot with a whole bitstream can be marked; write one first",
        c::STORE_RECORDS_FULL => {
            "the slot has no place for another mark; erase it and write it again"
        }
        _ => "a result that this program does not know",
    }
}

/// How a slot is written down in words.
pub fn state_name(state: State) -> &'static str {
    match state {
        State::Empty => "empty",
        State::Unfinished => "unfinished",
        State::Whole => "whole",
        State::Damaged => "damaged",
    }
}

/// What is told while bytes move: how many of how many.
pub type Progress<'a> = &'a mut dyn FnMut(usize, usize);

/// An open turret with our firmware.
pub struct Turret {
    device: Box<dyn Device>,
    alternate: u32,
}

impl Turret {
    /// Opens the turret that is meant.
    ///
    /// # Errors
    /// If there is none or more than one, it cannot be used, or its firmware is another one.
    pub fn open(selector: Option<&Selector>) -> Result<Self, TurretError> {
        Self::new(select::open(selector, false)?)
    }

    /// An open device that must be a turret.
    ///
    /// # Errors
    /// If it is none, or its firmware speaks another API level.
    pub fn new(device: Box<dyn Device>) -> Result<Self, TurretError> {
        let identity = device.identity();
        let name = identity.name.clone();
        if !select::is_turret(identity) {
            let (vendor, product) = (identity.vendor, identity.product);
            return Err(TurretError::Stranger { name, vendor, product });
        }
        let found = identity.release >> 8;
        if u32::from(found) != c::USB_API_LEVEL {
            return Err(TurretError::ApiLevel { name, found });
        }
        Ok(Self { device, alternate: c::USB_ALTERNATE_CONTROL })
    }

    /// The device itself.
    pub fn device(&mut self) -> &mut dyn Device {
        &mut *self.device
    }

    /// The device itself, for something that ends the firmware.
    pub fn into_device(self) -> Box<dyn Device> {
        self.device
    }

    fn request(
        &mut self,
        number: u32,
        value: u16,
        index: u16,
        data: &[u8],
    ) -> Result<(), LinkError> {
        let setup = Setup { kind: VENDOR_OUT, request: number as u8, value, index };
        self.device.control_out(setup, data)
    }

    fn ask<const N: usize>(&mut self, number: u32) -> Result<[u8; N], TurretError> {
        let setup = Setup { kind: VENDOR_IN, request: number as u8, value: 0, index: 0 };
        let reply = self.device.control_in(setup, N as u16)?;
        reply.try_into().map_err(|_| TurretError::Status)
    }

    /// How the FPGA's configuration stands.
    ///
    /// # Errors
    /// If the turret does not tell.
    pub fn config_status(&mut self) -> Result<ConfigStatus, TurretError> {
        let wire = self.ask::<CONFIG_STATUS_SIZE>(c::REQUEST_CONFIG_STATUS)?;
        config_status_decode(&wire).ok_or(TurretError::Status)
    }

    /// How the last work on the bitstream store stands.
    ///
    /// # Errors
    /// If the turret does not tell.
    pub fn store_status(&mut self) -> Result<StoreStatus, TurretError> {
        let wire = self.ask::<STORE_STATUS_SIZE>(c::REQUEST_STORE_STATUS)?;
        store_status_decode(&wire).ok_or(TurretError::Status)
    }

    /// The marked slots: default and golden.
    ///
    /// # Errors
    /// If the turret does not tell.
    pub fn marks(&mut self) -> Result<[Option<u8>; 2], TurretError> {
        let status = self.store_settled()?;
        if u32::from(status.result) == c::STORE_NO_FLASH {
            return Err(TurretError::Store(store_result(status.result).to_owned()));
        }
        let slot = |slot: u8| (slot != NO_SLOT).then_some(slot);
        Ok([slot(status.default_slot), slot(status.golden_slot)])
    }

    /// Ends whatever job is under way.
    ///
    /// # Errors
    /// If the turret does not answer.
    pub fn abort(&mut self) -> Result<(), TurretError> {
        Ok(self.request(c::REQUEST_ABORT, 0, 0, &[])?)
    }

    fn choose(&mut self, alternate: u32) -> Result<(), TurretError> {
        if self.alternate != alternate {
            self.device.set_alternate(alternate as u8)?;
            self.alternate = alternate;
        }
        Ok(())
    }

    /// Waits until the FPGA's configuration has a result.
    ///
    /// # Errors
    /// If it takes too long.
    pub fn config_settled(&mut self) -> Result<ConfigStatus, TurretError> {
        let end = Instant::now() + CONFIG_PATIENCE;
        loop {
            let status = self.config_status()?;
            if u32::from(status.result) != c::CONFIG_BUSY {
                return Ok(status);
            }
            rest(end, CONFIG_PATIENCE)?;
        }
    }

    fn store_settled(&mut self) -> Result<StoreStatus, TurretError> {
        let end = Instant::now() + STORE_PATIENCE;
        loop {
            let status = self.store_status()?;
            if u32::from(status.result) != c::STORE_BUSY {
                return Ok(status);
            }
            rest(end, STORE_PATIENCE)?;
        }
    }

    /// Starts a job that may be refused; waits first for one that is still under way.
    fn start(
        &mut self,
        what: &str,
        number: u32,
        value: u16,
        index: u16,
        data: &[u8],
    ) -> Result<(), TurretError> {
        self.config_settled()?;
        self.store_settled()?;
        self.request(number, value, index, data).map_err(|error| match error {
            LinkError::Refused => TurretError::Refused(what.to_owned()),
            other => other.into(),
        })
    }

    /// Sends a job's data. If the turret ends the job early, endpoint 02 stalls: that is no error here,
    /// the job's status says why.
    fn send(
        &mut self,
        data: &[u8],
        patience: Duration,
        progress: Progress,
    ) -> Result<(), TurretError> {
        let mut sent = 0;
        for piece in data.chunks(WRITE_PIECE) {
            if !self.send_whole(piece, patience)? {
                return Ok(());
            }
            sent += piece.len();
            progress(sent, data.len());
        }
        Ok(())
    }

    /// Sends `data` at once; false if the endpoint stalls.
    fn send_whole(&mut self, data: &[u8], patience: Duration) -> Result<bool, TurretError> {
        match self.device.bulk_out(BULK_OUT, data, patience) {
            Ok(()) => Ok(true),
            Err(LinkError::Refused) => {
                self.device.clear_halt(BULK_OUT)?;
                Ok(false)
            }
            Err(error) => Err(error.into()),
        }
    }

    /// Configures the FPGA with `stream`, which `header` describes; `partial` = change the running
    /// design.
    ///
    /// # Errors
    /// If the FPGA does not run that design now.
    pub fn configure(
        &mut self,
        header: &SlotHeader,
        stream: &[u8],
        partial: bool,
    ) -> Result<ConfigStatus, TurretError> {
        self.choose(c::USB_ALTERNATE_DATA)?;
        let kind = if partial { c::CONFIG_BEGIN_PARTIAL } else { c::CONFIG_BEGIN_FULL };
        let what = if partial {
            "change the FPGA's design: no design runs that could be changed, or the bitstream is for \
             another part"
        } else {
            "configure the FPGA: the bitstream is for another part"
        };
        let wire = slot_header_encode(header);
        self.start(what, c::REQUEST_CONFIG_BEGIN, kind as u16, 0, &wire)?;
        // In one go: the turret takes it faster than progress could be told.
        self.send_whole(stream, CONFIG_PATIENCE)?;
        let status = self.config_settled()?;
        let wanted = if partial { c::CONFIG_PARTIAL } else { c::CONFIG_FROM_USB };
        judge_config(status, wanted)
    }

    /// Configures the FPGA from `slot`, or from the default slot as at power-on.
    ///
    /// # Errors
    /// If the FPGA does not run that slot's design now.
    pub fn boot(&mut self, slot: Option<u8>) -> Result<ConfigStatus, TurretError> {
        let value = slot.map_or(c::CONFIG_BOOT_DEFAULT as u16, u16::from);
        self.start("configure the FPGA from its flash", c::REQUEST_CONFIG_BOOT, value, 0, &[])?;
        let status = self.config_settled()?;
        let wanted = if slot.is_some() { c::CONFIG_FROM_SLOT } else { c::CONFIG_FROM_DEFAULT };
        judge_config(status, wanted)
    }

    /// Reads blocks of the flash.
    fn read_blocks(
        &mut self,
        blocks: Range<usize>,
        progress: Progress,
    ) -> Result<Vec<u8>, TurretError> {
        self.choose(c::USB_ALTERNATE_DATA)?;
        let (first, count) = (blocks.start as u16, blocks.len() as u16);
        self.start("read its flash", c::REQUEST_STORE_READ, first, count, &[])?;
        let wanted = blocks.len() * BLOCK;
        let mut asked = 0;
        let mut bytes = Vec::with_capacity(wanted);
        let mut under_way = 0;
        while bytes.len() < wanted {
            while under_way < READS && asked < wanted {
                let size = READ_SIZE.min(wanted - asked);
                self.device.submit_read(BULK_IN, size)?;
                asked += size;
                under_way += 1;
            }
            let Some(piece) = self.device.next_read(BULK_IN, READ_PATIENCE)? else { break };
            under_way -= 1;
            if piece.is_empty() {
                break;
            }
            bytes.extend(piece);
            progress(bytes.len(), wanted);
        }
        if bytes.len() == wanted {
            return Ok(bytes);
        }
        self.device.cancel_reads(BULK_IN)?;
        let status = self.store_status()?;
        match u32::from(status.result) {
            c::STORE_OK | c::STORE_BUSY => Err(TurretError::Short { got: bytes.len(), wanted }),
            _ => Err(TurretError::Store(store_result(status.result).to_owned())),
        }
    }

    /// How slot `slot` stands, and its header if it holds a bitstream; its marks are not told.
    ///
    /// # Errors
    /// If the flash cannot be read.
    pub fn slot(&mut self, slot: u8) -> Result<(Slot, Option<SlotHeader>), TurretError> {
        let tails = [self.tail(slot, 0)?, self.tail(slot, 1)?];
        Ok(slot_of(slot, [&tails[0], &tails[1]]))
    }

    fn tail(&mut self, slot: u8, bank: usize) -> Result<[u8; TAIL_SIZE], TurretError> {
        let first = (bank_at(slot, bank) + c::BANK_HEADER_AT as usize) / BLOCK;
        let block = self.read_blocks(first..first + 1, &mut |_, _| {})?;
        let short = TurretError::Short { got: block.len(), wanted: BLOCK };
        block.first_chunk().copied().ok_or(short)
    }

    /// All slots, with their marks. Bitstreams are not read.
    ///
    /// # Errors
    /// If the flash cannot be read.
    pub fn slots(&mut self) -> Result<Vec<Slot>, TurretError> {
        let [default, golden] = self.marks()?;
        let mut slots = Vec::new();
        for number in 0..c::SLOT_COUNT as u8 {
            let (mut slot, _) = self.slot(number)?;
            slot.default = default == Some(number);
            slot.golden = golden == Some(number);
            slots.push(slot);
        }
        Ok(slots)
    }

    /// The header and bitstream of a slot, whether they match or not.
    ///
    /// # Errors
    /// If it holds none, or the flash cannot be read.
    pub fn read(
        &mut self,
        slot: u8,
        progress: Progress,
    ) -> Result<(SlotHeader, Vec<u8>), TurretError> {
        let (found, header) = self.slot(slot)?;
        let header = header.ok_or(TurretError::Slot {
            slot,
            why: match found.state {
                State::Empty => "is empty",
                _ => "holds no whole bitstream: its last write was interrupted; write it again",
            },
        })?;
        let first = bank_at(slot, found.bank as usize) / BLOCK;
        let length = header.length as usize;
        let mut bytes = self.read_blocks(first..first + length.div_ceil(BLOCK), progress)?;
        bytes.truncate(length);
        Ok((header, bytes))
    }

    /// A slot's bitstream, which must match its check sum.
    ///
    /// # Errors
    /// If it does not, or as [`Turret::read`].
    pub fn read_whole(
        &mut self,
        slot: u8,
        progress: Progress,
    ) -> Result<(SlotHeader, Vec<u8>), TurretError> {
        let (header, bytes) = self.read(slot, progress)?;
        if crc32(&bytes) == header.crc32 {
            return Ok((header, bytes));
        }
        Err(TurretError::Slot { slot, why: "is damaged: its check sum is wrong; write it again" })
    }

    /// Whether a slot holds exactly this.
    ///
    /// # Errors
    /// If the flash cannot be read.
    pub fn holds(
        &mut self,
        slot: u8,
        header: &SlotHeader,
        stream: &[u8],
    ) -> Result<bool, TurretError> {
        let (_, found) = self.slot(slot)?;
        let same = found.is_some_and(|found| {
            let key = |h: &SlotHeader| (h.function, h.length, h.crc32, h.part, h.name);
            key(&found) == key(header)
        });
        Ok(same && self.read(slot, &mut |_, _| {})?.1 == stream)
    }

    /// Writes a bitstream into a slot. The turret puts it beside the one that is there, which counts
    /// until the new one is whole.
    ///
    /// # Errors
    /// If it is not there now.
    pub fn write(
        &mut self,
        slot: u8,
        header: &SlotHeader,
        stream: &[u8],
        progress: Progress,
    ) -> Result<(), TurretError> {
        self.choose(c::USB_ALTERNATE_DATA)?;
        let wire = slot_header_encode(header);
        let what = format!("write slot {slot}: the bitstream is for another part");
        self.start(&what, c::REQUEST_STORE_WRITE, u16::from(slot), 0, &wire)?;
        self.send(stream, STORE_PATIENCE, progress)?;
        let status = self.store_settled()?;
        judge_store(status, "writing", slot)
    }

    /// Reads a slot back and compares.
    ///
    /// # Errors
    /// If it differs.
    pub fn verify(
        &mut self,
        slot: u8,
        stream: &[u8],
        progress: Progress,
    ) -> Result<(), TurretError> {
        let (_, bytes) = self.read(slot, progress)?;
        if bytes == stream {
            return Ok(());
        }
        let same = bytes.iter().zip(stream).take_while(|(a, b)| a == b).count();
        Err(TurretError::Differs { slot, at: same })
    }

    /// Erases a slot and its marks.
    ///
    /// # Errors
    /// If it cannot be erased.
    pub fn erase(&mut self, slot: u8) -> Result<(), TurretError> {
        let what = format!("erase slot {slot}");
        self.start(&what, c::REQUEST_STORE_ERASE, u16::from(slot), 0, &[])?;
        let status = self.store_settled()?;
        judge_store(status, "erasing", slot)
    }

    /// Makes a slot the default or the golden one; `kind` is `SLOT_RECORD_DEFAULT` or
    /// `SLOT_RECORD_GOLDEN`.
    ///
    /// # Errors
    /// If it holds no whole bitstream.
    pub fn mark(&mut self, slot: u8, kind: u32) -> Result<(), TurretError> {
        let what = format!("mark slot {slot}");
        self.start(&what, c::REQUEST_STORE_MARK, u16::from(slot), kind as u16, &[])?;
        let status = self.store_settled()?;
        judge_store(status, "marking", slot)
    }

    /// Reads the boot EEPROM.
    ///
    /// # Errors
    /// If it does not answer.
    pub fn read_eeprom(&mut self, range: Range<usize>) -> Result<Vec<u8>, TurretError> {
        let mut bytes = Vec::new();
        for at in range.clone().step_by(c::EEPROM_READ_MAX as usize) {
            let count = (range.end - at).min(c::EEPROM_READ_MAX as usize);
            let setup = Setup {
                kind: VENDOR_IN,
                request: c::REQUEST_EEPROM_READ as u8,
                value: at as u16,
                index: 0,
            };
            let piece =
                self.device.control_in(setup, count as u16).map_err(|error| match error {
                    LinkError::Refused => TurretError::Refused(
                        "read its boot EEPROM: it does not answer on the I2C bus".to_owned(),
                    ),
                    other => other.into(),
                })?;
            bytes.extend(piece);
        }
        Ok(bytes)
    }

    /// The serial number in the EEPROM, if there is one.
    ///
    /// # Errors
    /// If the EEPROM does not answer.
    pub fn stored_serial(&mut self) -> Result<Option<String>, TurretError> {
        let at = c::EEPROM_SERIAL_AT as usize;
        let bytes = self.read_eeprom(at..at + EEPROM_SERIAL_SIZE)?;
        let text = bytes.first_chunk().and_then(eeprom_serial_decode);
        Ok(text.map(|text| String::from_utf8_lossy(&text).into_owned()))
    }
}

fn bank_at(slot: u8, bank: usize) -> usize {
    usize::from(slot) * c::SLOT_SIZE as usize + bank * c::BANK_SIZE as usize
}

fn rest(end: Instant, patience: Duration) -> Result<(), TurretError> {
    if Instant::now() >= end {
        return Err(TurretError::Busy(patience.as_secs()));
    }
    std::thread::sleep(STATUS_PERIOD);
    Ok(())
}

fn judge_store(status: StoreStatus, doing: &str, slot: u8) -> Result<(), TurretError> {
    if u32::from(status.result) == c::STORE_OK {
        return Ok(());
    }
    let why = store_result(status.result);
    Err(TurretError::Store(format!("{doing} slot {slot} failed: {why}")))
}

/// Whether a configuration came from where it was to come from.
fn judge_config(status: ConfigStatus, wanted: u32) -> Result<ConfigStatus, TurretError> {
    let ok = u32::from(status.result) == c::CONFIG_OK;
    if ok && u32::from(status.source) == wanted {
        return Ok(status);
    }
    let text = if ok && u32::from(status.source) == c::CONFIG_FROM_GOLDEN {
        let why = config_result(status.cause);
        format!("the FPGA was not configured: {why}; the golden slot {} runs instead", status.slot)
    } else if ok {
        "the FPGA runs another configuration than the one asked for; somebody else uses the turret"
            .to_owned()
    } else {
        let left = if status.done != 0 { "the design before runs on" } else { "it is erased now" };
        format!("the FPGA was not configured: {}; {left}", config_result(status.result))
    };
    Err(TurretError::Config(text))
}
