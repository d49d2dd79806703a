//! Addresses of the special function registers that belong to the core.

/// Stack pointer.
pub const SP: u8 = 0x81;
/// Data pointer 0, low byte.
pub const DPL0: u8 = 0x82;
/// Data pointer 0, high byte.
pub const DPH0: u8 = 0x83;
/// Data pointer 1, low byte.
pub const DPL1: u8 = 0x84;
/// Data pointer 1, high byte.
pub const DPH1: u8 = 0x85;
/// Data pointer select: bit 0.
pub const DPS: u8 = 0x86;
/// Power control: bit 0 IDLE; bit 7 doubles the baud rate of serial port 0.
pub const PCON: u8 = 0x87;
/// Clock control: bits 2..0 stretch MOVX, bits 5..3 are the timers'.
pub const CKCON: u8 = 0x8E;
/// High byte of the address of `MOVX @Ri`.
pub const MPAGE: u8 = 0x92;
/// Interrupt enable.
pub const IE: u8 = 0xA8;
/// Interrupt priority.
pub const IP: u8 = 0xB8;
/// Program status word.
pub const PSW: u8 = 0xD0;
/// Accumulator.
pub const ACC: u8 = 0xE0;
/// Extended interrupt enable.
pub const EIE: u8 = 0xE8;
/// B register.
pub const B: u8 = 0xF0;
/// Extended interrupt priority.
pub const EIP: u8 = 0xF8;

/// The name of the core's register at `address`; `None` if the chip owns it.
#[must_use]
pub fn name(address: u8) -> Option<&'static str> {
    Some(match address {
        SP => "SP",
        DPL0 => "DPL0",
        DPH0 => "DPH0",
        DPL1 => "DPL1",
        DPH1 => "DPH1",
        DPS => "DPS",
        PCON => "PCON",
        CKCON => "CKCON",
        MPAGE => "MPAGE",
        IE => "IE",
        IP => "IP",
        PSW => "PSW",
        ACC => "ACC",
        EIE => "EIE",
        B => "B",
        EIP => "EIP",
        _ => return None,
    })
}

/// Whether the core itself holds the register at `address` (0x80..=0xFF).
#[must_use]
pub fn is_core(address: u8) -> bool {
    name(address).is_some()
}
