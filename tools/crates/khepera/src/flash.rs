//! The base's flash: one chip of AMD's command set, 512 KiB, 16 bits wide, boot sectors at the bottom.
//!
//! Commands, status bits and times are those of the Am29F400BB (data sheet: command definitions, write
//! operation status, erase and programming performance), typical values. Erase suspend is not modelled.
//! ASSUMPTIONS: sector 0 is protected, as production leaves it with the loader in it; the chip's RESET#
//! is wired to the base's reset line, so a reset ends what it is doing, half done.

use common_sys::constants as board;
use sim::{MS, Ps, US};

pub(crate) const FLASH_SIZE: usize = board::BOARD_FLASH_SIZE as usize;
/// First addresses of the sectors.
const SECTORS: [u32; 11] = [
    0x00000, 0x04000, 0x06000, 0x08000, 0x10000, 0x20000, 0x30000, 0x40000, 0x50000, 0x60000,
    0x70000,
];
const PROTECTED_SECTORS: usize = 1;
const PROGRAM_TIME: Ps = 12 * US;
const ERASE_TIME: Ps = 1000 * MS;
/// How long after a sector erase command another sector may be named.
const ERASE_WINDOW: Ps = 50 * US;
/// How long the chip is busy with a command for a protected sector.
const REFUSED_PROGRAM: Ps = 2 * US;
const REFUSED_ERASE: Ps = 100 * US;
/// Manufacturer AMD, device Am29F400BB.
const IDENTITY: [u16; 2] = [0x0001, 0x22AB];
/// Word addresses 555 and 2AA; the chip looks at the lower eleven address lines only.
const UNLOCK_1: u32 = 0x555 << 1;
const UNLOCK_2: u32 = 0x2AA << 1;
const UNLOCK_MASK: u32 = 0xFFE;

/// How much of a command sequence has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sequence {
    None,
    First,
    Second,
    /// The next word is data.
    Program,
    EraseSetUp,
    EraseFirst,
    EraseSecond,
}

/// What the chip does by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Doing {
    Nothing,
    Autoselect,
    /// Data that was asked for at an address, until when; refused ones change nothing.
    Program {
        address: u32,
        data: u16,
        until: Ps,
        refused: bool,
    },
    /// Sectors as bits, and until when others may be added and the erase lasts.
    Erase {
        sectors: u16,
        window: Ps,
        until: Ps,
    },
}

/// The chip.
#[derive(Clone)]
pub(crate) struct Flash {
    cells: Box<[u8; FLASH_SIZE]>,
    sequence: Sequence,
    doing: Doing,
    toggle: u16,
    /// Program and erase operations begun so far.
    operations: u64,
    /// State of the generator that says what a cut leaves behind (xorshift64).
    random: u64,
}

fn sector_of(address: u32) -> usize {
    SECTORS.partition_point(|&first| first <= address) - 1
}

fn sector_range(sector: usize) -> std::ops::Range<usize> {
    let end = SECTORS.get(sector + 1).map_or(FLASH_SIZE, |&next| next as usize);
    SECTORS[sector] as usize..end
}

fn bits(sectors: u16) -> impl Iterator<Item = usize> {
    (0..SECTORS.len()).filter(move |sector| sectors >> sector & 1 != 0)
}

impl Flash {
    /// A chip with `cells` of `FLASH_SIZE` bytes.
    pub fn new(cells: Vec<u8>) -> Self {
        let cells = cells.into_boxed_slice().try_into();
        Self {
            cells: cells.unwrap_or_else(|_| unreachable!("sized by the caller")),
            sequence: Sequence::None,
            doing: Doing::Nothing,
            toggle: 0,
            operations: 0,
            random: 0x9E37_79B9_7F4A_7C15,
        }
    }

    pub fn cells(&self) -> &[u8; FLASH_SIZE] {
        &self.cells
    }

    pub fn operations(&self) -> u64 {
        self.operations
    }

    /// Whether a read gives the contents: the fast path.
    #[inline]
    pub fn reads_cells(&self) -> bool {
        self.doing == Doing::Nothing
    }

    #[inline]
    pub fn cell_byte(&self, address: u32) -> u8 {
        self.cells[address as usize & (FLASH_SIZE - 1)]
    }

    #[inline]
    pub fn cell_word(&self, address: u32) -> u16 {
        let at = address as usize & (FLASH_SIZE - 2);
        u16::from_be_bytes([self.cells[at], self.cells[at + 1]])
    }

    /// A word as the CPU reads it now.
    #[cold]
    pub fn read(&mut self, now: Ps, address: u32) -> u16 {
        self.advance(now);
        match self.doing {
            Doing::Nothing => self.cell_word(address),
            Doing::Autoselect => match address >> 1 & 0xFF {
                index @ 0..=1 => IDENTITY[index as usize],
                2 => u16::from(sector_of(address & (FLASH_SIZE as u32 - 1)) < PROTECTED_SECTORS),
                _ => 0,
            },
            // DQ7 is the complement of the data's bit, DQ6 toggles with every read.
            Doing::Program { data, .. } => {
                self.toggle ^= 0x40;
                !data & 0x80 | self.toggle
            }
            // DQ7 is 0, DQ3 tells that no other sector can be added, DQ2 toggles with DQ6.
            Doing::Erase { window, .. } => {
                self.toggle ^= 0x40;
                self.toggle | self.toggle >> 4 | if now >= window { 0x08 } else { 0 }
            }
        }
    }

    /// The CPU writes a word. Returns what is wrong with it, if anything.
    pub fn write(&mut self, now: Ps, address: u32, value: u16) -> Option<&'static str> {
        self.advance(now);
        let address = address & (FLASH_SIZE as u32 - 2);
        let command = value as u8;
        match self.doing {
            Doing::Nothing | Doing::Autoselect => self.command(now, address, value, command),
            Doing::Erase { sectors, window, .. } if now < window && command == 0x30 => {
                self.begin_erase(now, sectors | 1 << sector_of(address))
            }
            Doing::Erase { .. } if command == 0xB0 => Some("flash: erase suspend is not modelled"),
            _ => Some("flash written while it is busy: ignored"),
        }
    }

    fn command(&mut self, now: Ps, address: u32, value: u16, command: u8) -> Option<&'static str> {
        let first = address & UNLOCK_MASK == UNLOCK_1;
        let unlock_1 = first && command == 0xAA;
        let unlock_2 = address & UNLOCK_MASK == UNLOCK_2 && command == 0x55;
        let sequence = std::mem::replace(&mut self.sequence, Sequence::None);
        self.sequence = match sequence {
            Sequence::Program => return self.begin_program(now, address, value),
            _ if command == 0xF0 => {
                self.doing = Doing::Nothing;
                Sequence::None
            }
            Sequence::None if unlock_1 => Sequence::First,
            Sequence::First if unlock_2 => Sequence::Second,
            Sequence::Second if first && command == 0xA0 => Sequence::Program,
            Sequence::Second if first && command == 0x80 => Sequence::EraseSetUp,
            Sequence::Second if first && command == 0x90 => {
                self.doing = Doing::Autoselect;
                Sequence::None
            }
            Sequence::EraseSetUp if unlock_1 => Sequence::EraseFirst,
            Sequence::EraseFirst if unlock_2 => Sequence::EraseSecond,
            Sequence::EraseSecond if command == 0x30 => {
                return self.begin_erase(now, 1 << sector_of(address));
            }
            Sequence::EraseSecond if first && command == 0x10 => {
                return self.begin_erase(now, (1 << SECTORS.len()) - 1);
            }
            _ => return Some("flash written without a command it knows: it keeps its contents"),
        };
        None
    }

    fn begin_program(&mut self, now: Ps, address: u32, data: u16) -> Option<&'static str> {
        self.operations += 1;
        let refused = sector_of(address) < PROTECTED_SECTORS;
        let until = now + if refused { REFUSED_PROGRAM } else { PROGRAM_TIME };
        self.doing = Doing::Program { address, data, until, refused };
        if refused {
            return Some("flash: program command for a protected sector");
        }
        // Only an erase makes a 0 a 1 again: a real chip tries until it times out.
        (self.cell_word(address) & data != data)
            .then_some("flash: programming cannot turn zeros into ones")
    }

    fn begin_erase(&mut self, now: Ps, sectors: u16) -> Option<&'static str> {
        let protected = (1 << PROTECTED_SECTORS) - 1;
        let erased = sectors & !protected;
        self.operations += 1;
        let window = now + ERASE_WINDOW;
        let until = match erased.count_ones() {
            0 => now + REFUSED_ERASE,
            count => window + u64::from(count) * ERASE_TIME,
        };
        self.doing = Doing::Erase { sectors: erased, window, until };
        (sectors != erased).then_some("flash: erase command for a protected sector")
    }

    /// When what the chip is doing will be half done: where a cut hurts most.
    pub fn half_done(&self, now: Ps) -> Option<Ps> {
        match self.doing {
            Doing::Program { until, .. } | Doing::Erase { until, .. } => {
                Some(now + until.saturating_sub(now) / 2)
            }
            _ => None,
        }
    }

    fn advance(&mut self, now: Ps) {
        match self.doing {
            Doing::Program { address, data, until, refused } if now >= until => {
                if !refused {
                    let word = self.cell_word(address) & data;
                    self.put(address, word);
                }
                self.doing = Doing::Nothing;
            }
            Doing::Erase { sectors, until, .. } if now >= until => {
                for sector in bits(sectors) {
                    self.cells[sector_range(sector)].fill(0xFF);
                }
                self.doing = Doing::Nothing;
            }
            _ => {}
        }
    }

    fn put(&mut self, address: u32, word: u16) {
        let at = address as usize & (FLASH_SIZE - 2);
        [self.cells[at], self.cells[at + 1]] = word.to_be_bytes();
    }

    fn draw(&mut self) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random
    }

    /// Reset or loss of supply: what was under way stays half done.
    pub fn interrupt(&mut self, now: Ps) {
        self.advance(now);
        match self.doing {
            // Some of the bits that shall become 0 are.
            Doing::Program { address, data, refused: false, .. } => {
                let done = self.draw() as u16;
                let word = self.cell_word(address) & (data | done);
                self.put(address, word);
            }
            Doing::Erase { sectors, window, .. } if now >= window => {
                for sector in bits(sectors) {
                    self.half_erase(sector);
                }
            }
            _ => {}
        }
        self.sequence = Sequence::None;
        self.doing = Doing::Nothing;
    }

    /// The chip first programs everything to 0, then erases: any cell may be old, 0, erased or between.
    fn half_erase(&mut self, sector: usize) {
        for at in sector_range(sector) {
            let random = self.draw();
            self.cells[at] = match random & 3 {
                0 => self.cells[at],
                1 => 0,
                2 => 0xFF,
                _ => (random >> 8) as u8,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unlock(flash: &mut Flash, now: Ps) {
        assert_eq!(flash.write(now, 0xAAA, 0xAA), None);
        assert_eq!(flash.write(now, 0x554, 0x55), None);
    }

    fn program(flash: &mut Flash, now: Ps, address: u32, data: u16) -> Option<&'static str> {
        unlock(flash, now);
        assert_eq!(flash.write(now, 0xAAA, 0xA0), None);
        flash.write(now, address, data)
    }

    fn erase(flash: &mut Flash, now: Ps, address: u32) -> Option<&'static str> {
        unlock(flash, now);
        assert_eq!(flash.write(now, 0xAAA, 0x80), None);
        unlock(flash, now);
        flash.write(now, address, 0x30)
    }

    fn chip() -> Flash {
        let mut cells = vec![0xFF; FLASH_SIZE];
        cells[0x4000..0x6000].fill(0x5A);
        Flash::new(cells)
    }

    #[test]
    fn a_word_is_programmed_after_its_time_with_status_meanwhile() {
        let mut flash = chip();
        assert_eq!(program(&mut flash, 0, 0x1_0000, 0x1234), None);
        let (one, two) = (flash.read(US, 0x1_0000), flash.read(2 * US, 0x1_0000));
        assert_eq!(one & 0x80, 0x80, "DQ7 is the complement of bit 7 of 34");
        assert_eq!((one ^ two) & 0x40, 0x40, "DQ6 toggles");
        assert_eq!(flash.read(13 * US, 0x1_0000), 0x1234);
        assert_eq!(flash.operations(), 1);
    }

    #[test]
    fn programming_only_clears_bits() {
        let mut flash = chip();
        assert!(program(&mut flash, 0, 0x4000, 0xFF0F).is_some());
        assert_eq!(flash.read(MS, 0x4000), 0x5A0A);
    }

    #[test]
    fn an_erase_reaches_its_sectors_and_no_other() {
        let mut flash = chip();
        program(&mut flash, 0, 0x6000, 0);
        assert_eq!(erase(&mut flash, MS, 0x4002), None);
        assert_eq!(flash.read(MS, 0x4000) & 0x88, 0, "other sectors can still be added");
        assert_eq!(flash.read(2 * MS, 0x4000) & 0x88, 0x08);
        assert_eq!(flash.read(MS + ERASE_TIME + ERASE_WINDOW, 0x4000), 0xFFFF);
        assert_eq!((flash.cell_word(0x5FFE), flash.cell_word(0x6000)), (0xFFFF, 0));
    }

    #[test]
    fn the_loader_s_sector_is_protected() {
        let mut flash = chip();
        assert!(program(&mut flash, 0, 0x100, 0).is_some());
        assert!(erase(&mut flash, MS, 0x100).is_some());
        assert_eq!(flash.read(3 * MS, 0x100), 0xFFFF);
    }

    #[test]
    fn a_cut_leaves_an_operation_half_done_and_the_rest_alone() {
        let mut flash = chip();
        program(&mut flash, 0, 0x1_0000, 0);
        flash.interrupt(6 * US);
        assert_eq!(flash.read(7 * US, 0x1_0002), 0xFFFF);
        erase(&mut flash, MS, 0x4000);
        flash.interrupt(500 * MS);
        let sector = &flash.cells()[0x4000..0x6000];
        assert!(sector.contains(&0xFF) && sector.iter().any(|&cell| cell != 0xFF));
        assert!(flash.reads_cells());
    }

    #[test]
    fn writes_without_a_command_change_nothing_and_are_told() {
        let mut flash = chip();
        assert!(flash.write(0, 0x4000, 0).is_some());
        assert_eq!(flash.read(0, 0x4000), 0x5A5A);
        unlock(&mut flash, 0);
        flash.write(0, 0xAAA, 0x90);
        assert_eq!((flash.read(0, 0), flash.read(0, 2)), (0x0001, 0x22AB));
        flash.write(0, 0, 0xF0);
        assert_eq!(flash.read(0, 0x4000), 0x5A5A);
    }
}
