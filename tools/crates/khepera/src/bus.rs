//! The CPU's bus: memory, registers, and what happens when nobody answers or an address is odd.

use m68k::AddressBus;
use m68k::core::memory::{BusFault, BusFaultKind};

use crate::memory::{Device, Page};
use crate::soc::Soc;
use crate::turret_bus::TurretBus;

/// System clocks of an access to a register.
const REGISTER_CLOCKS: u64 = 2;
const ADDRESS_MASK: u32 = 0xFF_FFFF;

/// An access that ended in a bus or address error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Fault {
    pub address: u32,
    pub write: bool,
    /// Bytes of the operand.
    pub size: u8,
    pub instruction: bool,
    /// Odd address: vector 3. Otherwise nobody answered: vector 2.
    pub odd: bool,
    /// Nobody answered and no monitor watched: the CPU waits for ever.
    pub hangs: bool,
}

/// The CPU's view: chip, board and turret.
pub(crate) struct Bus<'a, T> {
    pub soc: &'a mut Soc,
    pub turret: &'a mut T,
}

impl<T: TurretBus> Bus<'_, T> {
    #[cold]
    fn fail(&mut self, fault: Fault) -> BusFault {
        let what = if fault.odd {
            "odd address: address error"
        } else if fault.hangs {
            "nobody answers and SYPCR.BME is 0: the CPU hangs"
        } else {
            self.soc.clk += self.soc.system.bus_monitor_clocks();
            "nobody answers: bus error"
        };
        self.soc.warn(fault.address, fault.write, what);
        self.soc.fault = Some(fault);
        BusFault { kind: BusFaultKind::BusError, address: fault.address }
    }

    #[cold]
    fn nobody(&mut self, address: u32, write: bool, size: u8) -> BusFault {
        let hangs = !self.soc.system.bus_monitor();
        self.fail(Fault { address, write, size, instruction: false, odd: false, hangs })
    }

    #[cold]
    fn odd(&mut self, address: u32, write: bool, size: u8) -> BusFault {
        let odd = Fault { address, write, size, instruction: false, odd: true, hangs: false };
        self.fail(odd)
    }

    fn register_read(&mut self, address: u32, mask: u16) -> Result<u16, BusFault> {
        self.soc.clk += REGISTER_CLOCKS;
        self.soc.catch_up(self.turret);
        let value = self.soc.read_register(address & !1, mask);
        match value {
            Some(value) => {
                self.soc.request();
                Ok(value)
            }
            None => Err(self.nobody(address, false, 2)),
        }
    }

    fn register_write(&mut self, address: u32, value: u16, mask: u16) -> Result<(), BusFault> {
        self.soc.clk += REGISTER_CLOCKS;
        self.soc.catch_up(self.turret);
        if self.soc.write_register(address & !1, value, mask, self.turret) {
            Ok(())
        } else {
            Err(self.nobody(address, true, 2))
        }
    }

    /// The flash while it is busy or tells who it is.
    #[cold]
    fn flash_read(&mut self, address: u32) -> u16 {
        let now = self.soc.now();
        self.soc.memory.flash.read(now, address)
    }

    #[cold]
    fn flash_write(&mut self, address: u32, value: u16) {
        let now = self.soc.now();
        if let Some(what) = self.soc.memory.flash.write(now, address, value) {
            self.soc.warn(address, true, what);
        }
        self.soc.plan_cut();
    }

    fn read_word_slow(&mut self, address: u32, page: Page) -> Result<u16, BusFault> {
        match page.device {
            Device::Registers => self.register_read(address, 0xFFFF),
            Device::HalfRam => {
                self.soc.clk += u64::from(page.clocks);
                Ok(self.soc.memory.half_ram_word(address, page))
            }
            Device::Flash => {
                self.soc.clk += u64::from(page.clocks);
                Ok(self.flash_read(address))
            }
            _ => Err(self.nobody(address, false, 2)),
        }
    }

    #[inline]
    fn fetch_word(&mut self, address: u32) -> Result<u16, BusFault> {
        let before = self.soc.clk;
        let result = self.try_read_word(address);
        self.soc.fetched_to = address.wrapping_add(2);
        self.soc.fetch_clocks = self.soc.clk - before;
        if result.is_err()
            && let Some(fault) = &mut self.soc.fault
        {
            fault.instruction = true;
        }
        result
    }
}

impl<T: TurretBus> AddressBus for Bus<'_, T> {
    fn read_byte(&mut self, address: u32) -> u8 {
        self.try_read_byte(address).unwrap_or(0xFF)
    }

    fn read_word(&mut self, address: u32) -> u16 {
        self.try_read_word(address).unwrap_or(0xFFFF)
    }

    fn read_long(&mut self, address: u32) -> u32 {
        self.try_read_long(address).unwrap_or(0xFFFF_FFFF)
    }

    fn write_byte(&mut self, address: u32, value: u8) {
        // A fault is kept in `soc.fault`.
        let _ = self.try_write_byte(address, value);
    }

    fn write_word(&mut self, address: u32, value: u16) {
        let _ = self.try_write_word(address, value);
    }

    fn write_long(&mut self, address: u32, value: u32) {
        let _ = self.try_write_long(address, value);
    }

    #[inline]
    fn try_read_byte(&mut self, address: u32) -> Result<u8, BusFault> {
        if self.soc.fault.is_some() {
            return Ok(0);
        }
        let address = address & ADDRESS_MASK;
        let page = self.soc.memory.read_page(address);
        self.soc.clk += u64::from(page.clocks);
        match page.device {
            Device::Flash if self.soc.memory.flash.reads_cells() => {
                Ok(self.soc.memory.flash.cell_byte(address))
            }
            Device::Flash => {
                let both = self.flash_read(address & !1).to_be_bytes();
                Ok(both[address as usize & 1])
            }
            Device::Ram => Ok(self.soc.memory.ram_byte(address)),
            Device::None => Err(self.nobody(address, false, 1)),
            Device::HalfRam => {
                let both = self.soc.memory.half_ram_word(address, page).to_be_bytes();
                Ok(both[address as usize & 1])
            }
            Device::Registers => {
                let mask = 0xFF00 >> (8 * (address & 1));
                let both = self.register_read(address, mask)?.to_be_bytes();
                Ok(both[address as usize & 1])
            }
        }
    }

    #[inline]
    fn try_read_word(&mut self, address: u32) -> Result<u16, BusFault> {
        if self.soc.fault.is_some() {
            return Ok(0);
        }
        let address = address & ADDRESS_MASK;
        if address & 1 != 0 {
            return Err(self.odd(address, false, 2));
        }
        let page = self.soc.memory.read_page(address);
        match page.device {
            Device::Flash if self.soc.memory.flash.reads_cells() => {
                self.soc.clk += u64::from(page.clocks);
                Ok(self.soc.memory.flash.cell_word(address))
            }
            Device::Ram => {
                self.soc.clk += u64::from(page.clocks);
                Ok(self.soc.memory.ram_word(address))
            }
            _ => self.read_word_slow(address, page),
        }
    }

    #[inline]
    fn try_read_long(&mut self, address: u32) -> Result<u32, BusFault> {
        if address & 1 != 0 && self.soc.fault.is_none() {
            return Err(self.odd(address & ADDRESS_MASK, false, 4));
        }
        let upper = self.try_read_word(address)?;
        let lower = self.try_read_word(address.wrapping_add(2))?;
        Ok(u32::from(upper) << 16 | u32::from(lower))
    }

    #[inline]
    fn try_write_byte(&mut self, address: u32, value: u8) -> Result<(), BusFault> {
        if self.soc.fault.is_some() {
            return Ok(());
        }
        let address = address & ADDRESS_MASK;
        let page = self.soc.memory.write_page(address);
        self.soc.clk += u64::from(page.clocks);
        match page.device {
            Device::Ram => self.soc.memory.set_ram_byte(address, value),
            Device::None => return Err(self.nobody(address, true, 1)),
            Device::Flash => self.flash_write(address & !1, u16::from(value) * 0x0101),
            // The CPU drives the byte on both halves of the data bus.
            Device::HalfRam => {
                let lanes = 2 >> (address & 1);
                self.soc.memory.set_half_ram(address, u16::from(value) * 0x0101, lanes, page);
            }
            Device::Registers => {
                let mask = 0xFF00 >> (8 * (address & 1));
                return self.register_write(address, u16::from(value) * 0x0101, mask);
            }
        }
        Ok(())
    }

    #[inline]
    fn try_write_word(&mut self, address: u32, value: u16) -> Result<(), BusFault> {
        if self.soc.fault.is_some() {
            return Ok(());
        }
        let address = address & ADDRESS_MASK;
        if address & 1 != 0 {
            return Err(self.odd(address, true, 2));
        }
        let page = self.soc.memory.write_page(address);
        self.soc.clk += u64::from(page.clocks);
        match page.device {
            Device::Ram => self.soc.memory.set_ram_word(address, value),
            Device::None => return Err(self.nobody(address, true, 2)),
            Device::Flash => self.flash_write(address, value),
            Device::HalfRam => self.soc.memory.set_half_ram(address, value, 3, page),
            Device::Registers => return self.register_write(address, value, 0xFFFF),
        }
        Ok(())
    }

    #[inline]
    fn try_write_long(&mut self, address: u32, value: u32) -> Result<(), BusFault> {
        if address & 1 != 0 && self.soc.fault.is_none() {
            return Err(self.odd(address & ADDRESS_MASK, true, 4));
        }
        self.try_write_word(address, (value >> 16) as u16)?;
        self.try_write_word(address.wrapping_add(2), value as u16)
    }

    #[inline]
    fn try_read_immediate_word(&mut self, address: u32) -> Result<u16, BusFault> {
        self.fetch_word(address)
    }

    #[inline]
    fn try_read_immediate_long(&mut self, address: u32) -> Result<u32, BusFault> {
        let upper = self.fetch_word(address)?;
        let lower = self.fetch_word(address.wrapping_add(2))?;
        Ok(u32::from(upper) << 16 | u32::from(lower))
    }

    fn reset_devices(&mut self) {
        self.soc.reset_modules();
        self.soc.plan_drive();
        self.soc.plan();
    }
}
