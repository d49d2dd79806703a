//! Interrupt requests: INT2 (USB), INT4 (FIFO and GPIF) with their vectors, and the flags of EXIF
//! and EICON (TRM chapter 4).

use mcs51::Source;
use serde::{Deserialize, Serialize};

/// EXIF: INT2 requests.
pub(crate) const EXIF_USB: u8 = 0x10;
/// EXIF: the I²C controller requests.
pub(crate) const EXIF_I2C: u8 = 0x20;
/// EXIF: INT4 requests.
pub(crate) const EXIF_INT4: u8 = 0x40;
/// EICON: resume flag.
pub(crate) const EICON_RESUME: u8 = 0x10;
const EICON_RESUME_ENABLE: u8 = 0x20;
const INTSETUP_AV2EN: u8 = 0x08;
const INTSETUP_INT4SRC: u8 = 0x02;
const INTSETUP_AV4EN: u8 = 0x01;

/// The 32 sources of INT2. Bit n has vector 4n; the four bytes are USBIRQ, EPIRQ, NAKIRQ and
/// USBERRIRQ, because the registers' order is that of the vectors.
pub(crate) mod usb {
    pub(crate) const SUDAV: u32 = 1 << 0;
    pub(crate) const SOF: u32 = 1 << 1;
    pub(crate) const SUTOK: u32 = 1 << 2;
    pub(crate) const SUSPEND: u32 = 1 << 3;
    pub(crate) const RESET: u32 = 1 << 4;
    pub(crate) const HSGRANT: u32 = 1 << 5;
    pub(crate) const EP0ACK: u32 = 1 << 6;
    pub(crate) const EP0IN: u32 = 1 << 8;
    pub(crate) const EP0OUT: u32 = 1 << 9;
    pub(crate) const EP1IN: u32 = 1 << 10;
    pub(crate) const EP1OUT: u32 = 1 << 11;
    /// EP2; EP4, EP6, EP8 are the next bits.
    pub(crate) const EP2: u32 = 1 << 12;
    pub(crate) const IBN: u32 = 1 << 16;
    /// A PING to EP0 was answered with NAK; EP1, 2, 4, 6, 8 are the next bits.
    pub(crate) const PING_EP0: u32 = 1 << 18;
}

/// The 14 sources of INT4. Bit n has vector 0x80 + 4n.
pub(crate) mod fifo {
    /// Programmable flag of EP2; then EP4, 6, 8, then their empty flags, then their full flags.
    pub(crate) const EP2PF: u16 = 1 << 0;
    pub(crate) const EP2EF: u16 = 1 << 4;
    pub(crate) const EP2FF: u16 = 1 << 8;
    pub(crate) const GPIFDONE: u16 = 1 << 12;
    pub(crate) const GPIFWF: u16 = 1 << 13;
}

/// All request and enable flags but those of timers and serial ports.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Interrupts {
    pub(crate) usb_irq: u32,
    pub(crate) usb_ie: u32,
    pub(crate) fifo_irq: u16,
    pub(crate) fifo_ie: u16,
    pub(crate) ibn_irq: u8,
    pub(crate) ibn_ie: u8,
    pub(crate) exif: u8,
    pub(crate) eicon: u8,
    pub(crate) setup: u8,
}

impl Interrupts {
    pub(crate) fn new() -> Self {
        Self {
            usb_irq: 0,
            usb_ie: 0,
            fifo_irq: 0,
            fifo_ie: 0,
            ibn_irq: 0,
            ibn_ie: 0,
            exif: 0x08,
            eicon: 0x40,
            setup: 0,
        }
    }

    /// Sources of INT2 request. A pulse reaches EXIF when an enabled one was not pending before.
    pub(crate) fn raise_usb(&mut self, bits: u32) {
        if bits & self.usb_ie & !self.usb_irq != 0 {
            self.exif |= EXIF_USB;
        }
        self.usb_irq |= bits;
    }

    /// Firmware clears requests; if others wait, the controller pulses INT2 again.
    pub(crate) fn clear_usb(&mut self, bits: u32) {
        self.usb_irq &= !bits;
        if self.usb_irq & self.usb_ie != 0 {
            self.exif |= EXIF_USB;
        }
    }

    pub(crate) fn set_usb_ie(&mut self, enabled: u32) {
        if enabled & !self.usb_ie & self.usb_irq != 0 {
            self.exif |= EXIF_USB;
        }
        self.usb_ie = enabled;
    }

    /// As [`Self::raise_usb`] for INT4.
    pub(crate) fn raise_fifo(&mut self, bits: u16) {
        if bits & self.fifo_ie & !self.fifo_irq != 0 {
            self.pulse_int4();
        }
        self.fifo_irq |= bits;
    }

    pub(crate) fn clear_fifo(&mut self, bits: u16) {
        self.fifo_irq &= !bits;
        if self.fifo_irq & self.fifo_ie != 0 {
            self.pulse_int4();
        }
    }

    pub(crate) fn set_fifo_ie(&mut self, enabled: u16) {
        if enabled & !self.fifo_ie & self.fifo_irq != 0 {
            self.pulse_int4();
        }
        self.fifo_ie = enabled;
    }

    /// With INT4SRC clear, INT4 is the pin, which nothing drives.
    fn pulse_int4(&mut self) {
        if self.setup & INTSETUP_INT4SRC != 0 {
            self.exif |= EXIF_INT4;
        }
    }

    /// An IN token was answered with NAK: `bit` 0 = EP0, 1 = EP1, 2.. = EP2, 4, 6, 8.
    pub(crate) fn raise_ibn(&mut self, bit: u8) {
        self.ibn_irq |= 1 << bit;
        if self.ibn_ie >> bit & 1 != 0 {
            self.raise_usb(usb::IBN);
        }
    }

    /// INT2IVEC: the vector of the highest enabled request, 0 if none.
    pub(crate) fn usb_vector(&self) -> u8 {
        let pending = self.usb_irq & self.usb_ie;
        if pending == 0 { 0 } else { 4 * pending.trailing_zeros() as u8 }
    }

    /// INT4IVEC.
    pub(crate) fn fifo_vector(&self) -> u8 {
        let pending = self.fifo_irq & self.fifo_ie;
        if pending == 0 { 0x80 } else { 0x80 + 4 * pending.trailing_zeros() as u8 }
    }

    /// The byte that replaces the low half of the jump at 0x43 or 0x53, if autovectoring is on.
    pub(crate) fn autovector(&self, address: u16) -> Option<u8> {
        match address {
            0x45 if self.setup & INTSETUP_AV2EN != 0 => Some(self.usb_vector()),
            0x55 if self.setup & INTSETUP_AV4EN != 0 => Some(self.fifo_vector()),
            _ => None,
        }
    }

    /// The request lines that come from EXIF and EICON.
    pub(crate) fn requests(&self) -> u16 {
        let line = |on: bool, source: Source| if on { source.mask() } else { 0 };
        line(self.exif & EXIF_USB != 0, Source::Int2Usb)
            | line(self.exif & EXIF_I2C != 0, Source::I2c)
            | line(self.exif & EXIF_INT4 != 0, Source::Int4Fifo)
            | line(self.exif & 0x80 != 0, Source::Int5)
            | line(self.eicon & 0x08 != 0, Source::Int6)
            | line(
                self.eicon & EICON_RESUME != 0 && self.eicon & EICON_RESUME_ENABLE != 0,
                Source::Resume,
            )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn int2_pulses_again_while_another_source_waits() {
        let mut i = Interrupts::new();
        i.set_usb_ie(usb::SUDAV | usb::RESET);
        i.raise_usb(usb::RESET | usb::SUDAV | usb::SOF);
        assert_eq!((i.exif & EXIF_USB, i.usb_vector()), (EXIF_USB, 0x00));
        i.exif &= !EXIF_USB;
        i.clear_usb(usb::SUDAV);
        assert_eq!((i.exif & EXIF_USB, i.usb_vector()), (EXIF_USB, 0x10));
        i.exif &= !EXIF_USB;
        i.clear_usb(usb::RESET);
        assert_eq!(i.exif & EXIF_USB, 0, "SOF is not enabled");
    }

    #[test]
    fn int4_needs_its_source_and_vectors_from_0x80() {
        let mut i = Interrupts::new();
        i.set_fifo_ie(fifo::GPIFDONE);
        i.raise_fifo(fifo::GPIFDONE);
        assert_eq!(i.exif & EXIF_INT4, 0);
        i.clear_fifo(fifo::GPIFDONE);
        i.setup = INTSETUP_INT4SRC | INTSETUP_AV4EN;
        i.raise_fifo(fifo::GPIFDONE);
        assert_eq!(i.exif & EXIF_INT4, EXIF_INT4);
        assert_eq!(i.autovector(0x55), Some(0xB0));
        assert_eq!(i.autovector(0x45), None);
    }

    #[test]
    fn every_nak_of_an_enabled_endpoint_requests_again() {
        let mut i = Interrupts::new();
        i.set_usb_ie(usb::IBN);
        i.raise_ibn(2);
        assert_eq!((i.usb_irq, i.ibn_irq), (0, 1 << 2), "not enabled, but noted");
        i.ibn_ie = 1 << 2;
        i.raise_ibn(2);
        assert_eq!((i.usb_irq, i.usb_vector()), (usb::IBN, 0x40));
    }

    #[test]
    fn resume_needs_its_enable() {
        let mut i = Interrupts::new();
        i.eicon |= EICON_RESUME;
        assert_eq!(i.requests(), 0);
        i.eicon |= EICON_RESUME_ENABLE;
        assert_eq!(i.requests(), Source::Resume.mask());
    }
}
