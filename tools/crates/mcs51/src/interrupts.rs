//! The thirteen interrupt sources, their vectors and priorities (TRM chapter 4).

/// An interrupt source. Its number is its bit in [`Cpu::requests`](crate::Cpu::requests) and gives
/// its vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Source {
    /// Pin INT0#, flag IE0.
    Int0,
    /// Timer 0 overflow.
    Timer0,
    /// Pin INT1#, flag IE1.
    Int1,
    /// Timer 1 overflow.
    Timer1,
    /// Serial port 0, receive or transmit.
    Serial0,
    /// Timer 2 overflow or reload.
    Timer2,
    /// USB resume or wake-up pin: above both priority levels and not masked by EA. The chip keeps
    /// its enable bit (EICON.5) and requests only while it is set.
    Resume,
    /// Serial port 1, receive or transmit.
    Serial1,
    /// INT2: the USB engine.
    Int2Usb,
    /// INT3: the I²C controller.
    I2c,
    /// INT4: FIFOs and GPIF, or the pin.
    Int4Fifo,
    /// Pin INT5#.
    Int5,
    /// Pin INT6.
    Int6,
}

impl Source {
    /// All sources, by number.
    pub const ALL: [Source; 13] = [
        Source::Int0,
        Source::Timer0,
        Source::Int1,
        Source::Timer1,
        Source::Serial0,
        Source::Timer2,
        Source::Resume,
        Source::Serial1,
        Source::Int2Usb,
        Source::I2c,
        Source::Int4Fifo,
        Source::Int5,
        Source::Int6,
    ];

    /// Its bit in [`Cpu::requests`](crate::Cpu::requests).
    #[must_use]
    pub const fn mask(self) -> u16 {
        1 << self as u8
    }

    /// The address of its vector.
    #[must_use]
    pub const fn vector(self) -> u16 {
        8 * self as u16 + 3
    }
}

/// The `requests` bits that IE and EIE let through: IE.6 is serial port 1, EIE.4..0 are INT6..INT2.
pub(crate) const fn request_mask(ie: u8, eie: u8) -> u16 {
    (ie & 0x3F) as u16 | ((ie & 0x40) as u16) << 1 | ((eie & 0x1F) as u16) << 8
}
