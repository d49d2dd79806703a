//! QSM: the queued serial module: SCI, QSPI, port QS and the registers around them (QSMRM).

use sim::Ps;

use crate::qspi::{Pins, Qspi};
use crate::sci::Sci;

/// The module.
#[derive(Clone, Debug)]
pub(crate) struct Qsm {
    qsmcr: u16,
    qilr: u8,
    qivr: u8,
    pub sci: Sci,
    pub qspi: Qspi,
}

/// What a write did beyond the register.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Effect {
    pub pins: Option<Pins>,
    pub warning: Option<&'static str>,
}

impl From<Option<&'static str>> for Effect {
    fn from(warning: Option<&'static str>) -> Self {
        Self { warning, ..Self::default() }
    }
}

impl From<Option<Pins>> for Effect {
    fn from(pins: Option<Pins>) -> Self {
        Self { pins, ..Self::default() }
    }
}

impl Qsm {
    pub fn new(host_baud: Option<u32>) -> Self {
        Self { qsmcr: 0x0080, qilr: 0, qivr: 0x0F, sci: Sci::new(host_baud), qspi: Qspi::default() }
    }

    /// Chip reset: the lines outside and the queue RAM go on.
    pub fn reset(&mut self) {
        (self.qsmcr, self.qilr, self.qivr) = (0x0080, 0, 0x0F);
        self.sci.reset();
        self.qspi.reset();
    }

    pub fn iarb(&self) -> u8 {
        (self.qsmcr & 0xF) as u8
    }

    /// Interrupt levels that SCI and QSPI request, 0 = none.
    pub fn levels(&self) -> [u8; 2] {
        let sci = if self.sci.interrupt() { self.qilr & 7 } else { 0 };
        let qspi = if self.qspi.interrupt() { self.qilr >> 3 & 7 } else { 0 };
        [sci, qspi]
    }

    /// Vector for an acknowledge of `level`: bit 0 tells QSPI (1) and SCI (0) apart. At one level
    /// the QSPI comes first (QSMRM 3.3).
    pub fn vector(&self, level: u8) -> u8 {
        if self.levels()[1] == level { self.qivr | 1 } else { self.qivr & 0xFE }
    }

    /// Word at even `offset`; side effects only for the bytes in `mask`.
    pub fn read(&mut self, offset: u32, mask: u16) -> u16 {
        let pair = |high: u8, low: u8| u16::from(high) << 8 | u16::from(low);
        let low = mask & 0x00FF != 0;
        let qspi = &mut self.qspi;
        let queue = (offset as usize & 0x1F) / 2;
        match offset {
            0x00 => self.qsmcr,
            0x04 => pair(self.qilr, self.qivr),
            0x08 => self.sci.sccr0,
            0x0A => self.sci.sccr1,
            0x0C => self.sci.read_status(),
            0x0E if low => self.sci.read_data(),
            // Pins that nobody drives are pulled up.
            0x14 => u16::from(qspi.portqs | !qspi.ddrqs),
            0x16 => pair(qspi.pqspar, qspi.ddrqs),
            0x18 => qspi.spcr0,
            0x1A => qspi.spcr1,
            0x1C => qspi.spcr2,
            0x1E => pair(qspi.spcr3, if low { qspi.read_status() } else { 0 }),
            0x100..=0x11F => qspi.receive[queue],
            0x120..=0x13F => qspi.transmit[queue],
            0x140..=0x14F => {
                let first = offset as usize - 0x140;
                pair(qspi.commands[first], qspi.commands[first + 1])
            }
            _ => 0,
        }
    }

    /// Write the bytes in `mask` of the word at even `offset`.
    pub fn write(&mut self, clk: u64, now: Ps, offset: u32, value: u16, mask: u16) -> Effect {
        let merge = |old: u16| old & !mask | value & mask;
        let high = (mask & 0xFF00 != 0).then_some((value >> 8) as u8);
        let low = (mask & 0x00FF != 0).then_some(value as u8);
        match offset {
            0x00 => {
                self.qsmcr = merge(self.qsmcr) & 0xE08F;
                return (self.qsmcr & 0x8000 != 0).then_some("QSMCR.STOP: not modelled").into();
            }
            0x04 => {
                self.qilr = high.map_or(self.qilr, |v| v & 0x3F);
                self.qivr = low.map_or(self.qivr, |v| v | 1);
            }
            0x08 => self.sci.sccr0 = merge(self.sci.sccr0) & 0x1FFF,
            0x0A => return self.sci.write_control(clk, now, merge(self.sci.sccr1)).into(),
            0x0E if low.is_some() => return self.sci.write_data(clk, value & mask).into(),
            0x14 | 0x16 => return self.write_port(offset, high, low).into(),
            0x18..=0x1F => return self.write_queue(clk, offset, value, mask).into(),
            0x100..=0x14F => self.write_queue_ram(offset as usize, value, mask),
            0x0E => {}
            _ => return Some("QSM register that is read-only or not modelled").into(),
        }
        Effect::default()
    }

    fn write_port(&mut self, offset: u32, high: Option<u8>, low: Option<u8>) -> Option<Pins> {
        let qspi = &mut self.qspi;
        if offset == 0x14 {
            qspi.portqs = low.unwrap_or(qspi.portqs);
        } else {
            qspi.pqspar = high.unwrap_or(qspi.pqspar);
            qspi.ddrqs = low.unwrap_or(qspi.ddrqs);
        }
        qspi.port_changed()
    }

    fn write_queue(
        &mut self,
        clk: u64,
        offset: u32,
        value: u16,
        mask: u16,
    ) -> Option<&'static str> {
        let merge = |old: u16| old & !mask | value & mask;
        let qspi = &mut self.qspi;
        match offset {
            0x18 => qspi.spcr0 = merge(qspi.spcr0),
            0x1A => return qspi.write_spcr1(clk, merge(qspi.spcr1)),
            0x1C => qspi.write_spcr2(merge(qspi.spcr2)),
            _ => {
                if mask & 0xFF00 != 0 {
                    qspi.write_spcr3(clk, (value >> 8) as u8);
                }
                if mask & 0x00FF != 0 {
                    qspi.write_status(value as u8);
                }
            }
        }
        None
    }

    fn write_queue_ram(&mut self, offset: usize, value: u16, mask: u16) {
        let entry = (offset & 0x1F) / 2;
        let merge = |old: u16| old & !mask | value & mask;
        match offset {
            0x100..=0x11F => self.qspi.receive[entry] = merge(self.qspi.receive[entry]),
            0x120..=0x13F => self.qspi.transmit[entry] = merge(self.qspi.transmit[entry]),
            _ => {
                let two = &mut self.qspi.commands[offset - 0x140..offset - 0x140 + 2];
                let merged = merge(u16::from_be_bytes([two[0], two[1]]));
                two.copy_from_slice(&merged.to_be_bytes());
            }
        }
    }
}
