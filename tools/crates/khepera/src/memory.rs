//! Flash, RAM, and which of them answers where: the chip selects as a table of pages.

use common_sys::constants as board;

use crate::flash::{FLASH_SIZE, Flash};
use crate::integration::{CHIP_SELECTS, CS0, CS1, CSBOOT, Integration};

const RAM_SIZE: usize = board::BOARD_RAM_SIZE as usize;
const _: () = assert!(FLASH_SIZE.is_power_of_two() && RAM_SIZE.is_power_of_two());

/// The finest grain of chip selects: 2 KiB.
const PAGE_BITS: u32 = 11;
const PAGES: usize = 1 << (24 - PAGE_BITS);

/// What answers in a page of the address space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Device {
    /// Nobody.
    None,
    Flash,
    /// Both bytes of the RAM, each with its own byte select.
    Ram,
    /// The RAM with its selects set otherwise.
    HalfRam,
    Registers,
}

/// One page, for one direction of access.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Page {
    pub device: Device,
    /// System clocks of one bus cycle.
    pub clocks: u8,
    /// For `HalfRam`: CSOR.BYTE of the upper and of the lower byte's chip.
    upper: u8,
    lower: u8,
}

const NOBODY: Page = Page { device: Device::None, clocks: 0, upper: 0, lower: 0 };

/// Flash, RAM and the map.
#[derive(Clone)]
pub(crate) struct Memory {
    pub flash: Flash,
    ram: Box<[u8; RAM_SIZE]>,
    read_map: Vec<Page>,
    write_map: Vec<Page>,
}

fn boxed<const N: usize>(bytes: Vec<u8>) -> Box<[u8; N]> {
    bytes.into_boxed_slice().try_into().unwrap_or_else(|_| unreachable!("sized by the caller"))
}

/// What RAM holds at power-on: nothing that a program could rely on (xorshift64).
fn power_on_ram() -> Box<[u8; RAM_SIZE]> {
    let mut state = 0x2545_F491_4F6C_DD1Du64;
    let bytes = (0..RAM_SIZE).map(|_| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 32) as u8
    });
    boxed(bytes.collect())
}

fn word<const N: usize>(memory: &[u8; N], address: u32) -> u16 {
    let at = address as usize & (N - 2);
    u16::from_be_bytes([memory[at], memory[at + 1]])
}

/// All addresses have 24 bits; those of words are even.
impl Memory {
    /// With `flash` of `BOARD_FLASH_SIZE` bytes in it, and nobody mapped yet.
    pub fn new(flash: Vec<u8>) -> Self {
        Self {
            flash: Flash::new(flash),
            ram: power_on_ram(),
            read_map: vec![NOBODY; PAGES],
            write_map: vec![NOBODY; PAGES],
        }
    }

    pub fn lose_ram(&mut self) {
        self.ram = power_on_ram();
    }

    /// After a change of the chip selects.
    pub fn remap(&mut self, system: &Integration) {
        for page in 0..PAGES {
            let address = (page as u32) << PAGE_BITS;
            self.read_map[page] = page_at(system, address, false);
            self.write_map[page] = page_at(system, address, true);
        }
    }

    #[inline]
    pub fn read_page(&self, address: u32) -> Page {
        self.read_map[(address >> PAGE_BITS) as usize]
    }

    #[inline]
    pub fn write_page(&self, address: u32) -> Page {
        self.write_map[(address >> PAGE_BITS) as usize]
    }

    #[inline]
    pub fn ram_byte(&self, address: u32) -> u8 {
        self.ram[address as usize & (RAM_SIZE - 1)]
    }

    #[inline]
    pub fn ram_word(&self, address: u32) -> u16 {
        word(&self.ram, address)
    }

    #[inline]
    pub fn set_ram_byte(&mut self, address: u32, value: u8) {
        self.ram[address as usize & (RAM_SIZE - 1)] = value;
    }

    #[inline]
    pub fn set_ram_word(&mut self, address: u32, value: u16) {
        let at = address as usize & (RAM_SIZE - 2);
        [self.ram[at], self.ram[at + 1]] = value.to_be_bytes();
    }

    /// A read by selects other than one byte select for each chip: bytes of a chip that is not
    /// selected float high.
    pub fn half_ram_word(&self, address: u32, page: Page) -> u16 {
        let value = self.ram_word(address & !1);
        let upper = if page.upper & 2 != 0 { value & 0xFF00 } else { 0xFF00 };
        let lower = if page.lower & 1 != 0 { value & 0x00FF } else { 0x00FF };
        upper | lower
    }

    /// `lanes`: bit 1 = the access drives the upper byte's select, bit 0 = the lower's.
    pub fn set_half_ram(&mut self, address: u32, value: u16, lanes: u8, page: Page) {
        let [upper, lower] = value.to_be_bytes();
        if page.upper & lanes != 0 {
            self.set_ram_byte(address & !1, upper);
        }
        if page.lower & lanes != 0 {
            self.set_ram_byte(address | 1, lower);
        }
    }

    /// The word at `address` if it lies in memory; for looking, not for the CPU.
    #[inline]
    pub fn peek_word(&self, address: u32) -> Option<u16> {
        let address = address & 0xFF_FFFE;
        match self.read_page(address).device {
            Device::Flash => Some(self.flash.cell_word(address)),
            Device::Ram => Some(self.ram_word(address)),
            _ => None,
        }
    }

    /// Put a word into RAM; false where there is none.
    pub fn poke_word(&mut self, address: u32, value: u16) -> bool {
        let address = address & 0xFF_FFFE;
        let ram = self.read_page(address).device == Device::Ram;
        if ram {
            self.set_ram_word(address, value);
        }
        ram
    }
}

fn page_at(system: &Integration, address: u32, write: bool) -> Page {
    let registers: u32 = if system.registers_high() { 0xFFF000 } else { 0x7FF000 };
    if address & 0xFFF000 == registers {
        return Page { device: Device::Registers, ..NOBODY };
    }
    let select = |n| system.select(n, address, write);
    // The first select that brings its own DSACK ends the access.
    let clocks = (0..CHIP_SELECTS).filter_map(select).find_map(|s| s.clocks);
    let Some(clocks) = clocks else { return NOBODY };
    let byte = |n| select(n).map_or(0, |s| s.byte);
    let (flash, upper, lower) = (byte(CSBOOT), byte(CS0), byte(CS1));
    let device = match (flash, upper, lower) {
        (1.., _, _) => Device::Flash,
        // A select with nothing behind it (the extension bus): reads as ones, takes no writes.
        (0, 0, 0) => Device::HalfRam,
        (0, 2, 1) => Device::Ram,
        (0, 2.., 1 | 3) if !write => Device::Ram,
        _ => Device::HalfRam,
    };
    Page { device, clocks, upper, lower }
}
