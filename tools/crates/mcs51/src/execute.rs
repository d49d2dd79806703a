//! The instructions.
//!
//! From column 4 on, the opcode map is regular: the row (high nibble) is the operation, the column
//! its operand: 4 the accumulator or a constant, 5 a direct address, 6..7 @R0..@R1, 8..F R0..R7.
//! Columns 0..3 hold jumps, bit operations, rotations and MOVX.

use crate::cpu::Cpu;
use crate::{Bus, sfr};

/// PSW bits.
const CY: u8 = 0x80;
const AC: u8 = 0x40;
const BANK: u8 = 0x18;
const OV: u8 = 0x04;

/// Machine cycles of each opcode, MOVX without stretch. Jumps take the same time taken or not.
///
/// Source: the instruction set table of the TRM, cited from memory; its timing is that of the
/// DS80C320, and the lock step test compares every opcode with ucsim's. `DJNZ Rn` takes 3, although
/// some firmware counts 4 in its comments: so says ucsim, and an FX2 delay loop in the field
/// (NVMemProg) of nine NOP and one DJNZ makes 1 µs of 12 cycles. Assumptions: MUL and DIV take 5
/// (ucsim charges 7, adding the plain 8051's extra time once more), and the reserved opcode A5 is a
/// NOP.
#[rustfmt::skip]
const CYCLES: [u8; 256] = [
    // 0 1  2  3  4  5  6  7  8  9  A  B  C  D  E  F
    1, 3, 4, 1, 1, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, // 0_ INC
    4, 3, 4, 1, 1, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, // 1_ DEC
    4, 3, 4, 1, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, // 2_ ADD
    4, 3, 4, 1, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, // 3_ ADDC
    3, 3, 2, 3, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, // 4_ ORL
    3, 3, 2, 3, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, // 5_ ANL
    3, 3, 2, 3, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, // 6_ XRL
    3, 3, 2, 3, 2, 3, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, // 7_ MOV operand,#constant
    3, 3, 2, 3, 5, 3, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, // 8_ MOV direct,operand
    3, 3, 2, 3, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, // 9_ SUBB
    2, 3, 2, 3, 5, 1, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, // A_ MOV operand,direct
    2, 3, 2, 1, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, // B_ CJNE
    2, 3, 2, 1, 1, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, // C_ XCH
    2, 3, 2, 1, 1, 4, 1, 1, 3, 3, 3, 3, 3, 3, 3, 3, // D_ DJNZ
    2, 3, 2, 2, 1, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, // E_ MOV A,operand
    2, 3, 2, 2, 1, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, // F_ MOV operand,A
];

/// Where an instruction finds a byte.
#[derive(Clone, Copy)]
enum Place {
    Accumulator,
    /// RAM below 0x80, special function registers above.
    Direct(u8),
    /// Internal RAM, all of it: @Ri and Rn.
    Ram(u8),
}

impl Cpu {
    /// Executes the instruction at PC; returns its machine cycles.
    #[inline]
    pub(crate) fn execute<B: Bus>(&mut self, bus: &mut B) -> u32 {
        let opcode = self.fetch(bus);
        let stretch = match opcode {
            0xE0 | 0xE2 | 0xE3 | 0xF0 | 0xF2 | 0xF3 => self.ckcon & 7,
            _ => 0,
        };
        if opcode & 0x0F >= 4 {
            self.execute_regular(opcode, bus);
        } else {
            self.execute_irregular(opcode, bus);
        }
        u32::from(CYCLES[usize::from(opcode)] + stretch)
    }

    /// Columns 4..F of the opcode map.
    #[inline]
    fn execute_regular<B: Bus>(&mut self, opcode: u8, bus: &mut B) {
        match opcode >> 4 {
            0x0 => self.modify(opcode, bus, |value| value.wrapping_add(1)),
            0x1 => self.modify(opcode, bus, |value| value.wrapping_sub(1)),
            0x2 => {
                let value = self.operand(opcode, bus);
                self.add(value, false);
            }
            0x3 => {
                let value = self.operand(opcode, bus);
                self.add(value, self.carry());
            }
            0x4 => self.acc |= self.operand(opcode, bus),
            0x5 => self.acc &= self.operand(opcode, bus),
            0x6 => self.acc ^= self.operand(opcode, bus),
            0x7 => {
                let place = self.place(opcode, bus);
                let value = self.fetch(bus);
                self.write(place, value, bus);
            }
            0x8 if opcode == 0x84 => self.divide(),
            0x8 => {
                let place = self.place(opcode, bus);
                let value = self.read(place, bus);
                let destination = self.fetch(bus);
                self.write_direct(destination, value, bus);
            }
            0x9 => {
                let value = self.operand(opcode, bus);
                self.subtract(value);
            }
            0xA if opcode == 0xA4 => self.multiply(),
            0xA if opcode == 0xA5 => {}
            0xA => {
                let source = self.fetch(bus);
                let value = self.read_direct(source, bus);
                let place = self.place(opcode, bus);
                self.write(place, value, bus);
            }
            0xB => self.compare_jump(opcode, bus),
            0xC if opcode == 0xC4 => self.acc = self.acc.rotate_left(4),
            0xC => {
                let place = self.place(opcode, bus);
                let value = self.read(place, bus);
                let acc = std::mem::replace(&mut self.acc, value);
                self.write(place, acc, bus);
            }
            0xD => match opcode {
                0xD4 => self.decimal_adjust(),
                0xD6 | 0xD7 => self.exchange_digit(opcode),
                _ => self.decrement_jump(opcode, bus),
            },
            0xE if opcode == 0xE4 => self.acc = 0,
            0xE => {
                let place = self.place(opcode, bus);
                self.acc = self.read(place, bus);
            }
            _ if opcode == 0xF4 => self.acc = !self.acc,
            _ => {
                let place = self.place(opcode, bus);
                self.write(place, self.acc, bus);
            }
        }
    }

    /// Columns 0..3 of the opcode map.
    #[inline]
    fn execute_irregular<B: Bus>(&mut self, opcode: u8, bus: &mut B) {
        match opcode {
            0x00 => {}
            0x02 => self.pc = self.fetch_address(bus),
            0x12 => {
                let target = self.fetch_address(bus);
                self.call(target);
            }
            0x22 => self.pc = self.pop_address(),
            0x32 => self.return_from_interrupt(),
            0x03 => self.acc = self.acc.rotate_right(1),
            0x13 => {
                self.rotate_through_carry(self.acc & 1 != 0, |acc, carry| acc >> 1 | carry << 7)
            }
            0x23 => self.acc = self.acc.rotate_left(1),
            0x33 => self.rotate_through_carry(self.acc >> 7 != 0, |acc, carry| acc << 1 | carry),
            0x10 => self.jump_on_bit_and_clear(bus),
            0x20 => self.jump_on_bit(true, bus),
            0x30 => self.jump_on_bit(false, bus),
            0x40 => self.branch(self.carry(), bus),
            0x50 => self.branch(!self.carry(), bus),
            0x60 => self.branch(self.acc == 0, bus),
            0x70 => self.branch(self.acc != 0, bus),
            0x80 => self.branch(true, bus),
            0x42 => self.modify_direct(bus, |value, acc| value | acc),
            0x52 => self.modify_direct(bus, |value, acc| value & acc),
            0x62 => self.modify_direct(bus, |value, acc| value ^ acc),
            0x43 => self.modify_direct_constant(bus, |value, constant| value | constant),
            0x53 => self.modify_direct_constant(bus, |value, constant| value & constant),
            0x63 => self.modify_direct_constant(bus, |value, constant| value ^ constant),
            0x72 => self.carry_with_bit(bus, |carry, bit| carry | bit),
            0x82 => self.carry_with_bit(bus, |carry, bit| carry & bit),
            0xA0 => self.carry_with_bit(bus, |carry, bit| carry | !bit),
            0xB0 => self.carry_with_bit(bus, |carry, bit| carry & !bit),
            0xA2 => self.carry_with_bit(bus, |_, bit| bit),
            0x92 => self.modify_bit(bus, |_, carry| carry),
            0xB2 => self.modify_bit(bus, |bit, _| !bit),
            0xC2 => self.modify_bit(bus, |_, _| false),
            0xD2 => self.modify_bit(bus, |_, _| true),
            0xB3 => self.psw ^= CY,
            0xC3 => self.psw &= !CY,
            0xD3 => self.psw |= CY,
            0x73 => self.pc = self.dptr().wrapping_add(u16::from(self.acc)),
            0x83 => self.acc = bus.read_code(self.pc.wrapping_add(u16::from(self.acc))),
            0x93 => self.acc = bus.read_code(self.dptr().wrapping_add(u16::from(self.acc))),
            0x90 => *self.dptr_mut() = self.fetch_address(bus),
            0xA3 => *self.dptr_mut() = self.dptr().wrapping_add(1),
            0xC0 => self.push_direct(bus),
            0xD0 => self.pop_direct(bus),
            0xE0 => self.acc = bus.read_xdata(self.dptr()),
            0xE2 | 0xE3 => self.acc = bus.read_xdata(self.paged_address(opcode)),
            0xF0 => bus.write_xdata(self.dptr(), self.acc),
            0xF2 | 0xF3 => bus.write_xdata(self.paged_address(opcode), self.acc),
            _ => self.jump_in_page(opcode, bus), // column 1
        }
    }

    // Operands.

    fn fetch<B: Bus>(&mut self, bus: &mut B) -> u8 {
        let byte = bus.read_code(self.pc);
        self.pc = self.pc.wrapping_add(1);
        byte
    }

    fn fetch_address<B: Bus>(&mut self, bus: &mut B) -> u16 {
        let high = self.fetch(bus);
        u16::from_be_bytes([high, self.fetch(bus)])
    }

    /// The place that the opcode's column names; column 4 is the accumulator.
    fn place<B: Bus>(&mut self, opcode: u8, bus: &mut B) -> Place {
        match opcode & 0x0F {
            4 => Place::Accumulator,
            5 => Place::Direct(self.fetch(bus)),
            6 | 7 => Place::Ram(self.iram[self.register(opcode & 1)]),
            _ => Place::Ram(self.register(opcode & 7) as u8),
        }
    }

    /// The value that the opcode's column names; column 4 is a constant.
    fn operand<B: Bus>(&mut self, opcode: u8, bus: &mut B) -> u8 {
        if opcode & 0x0F == 4 {
            return self.fetch(bus);
        }
        let place = self.place(opcode, bus);
        self.read(place, bus)
    }

    /// Where register `number` (0..=7) of the current bank is in internal RAM.
    fn register(&self, number: u8) -> usize {
        usize::from(self.psw & BANK | number)
    }

    fn read<B: Bus>(&mut self, place: Place, bus: &mut B) -> u8 {
        match place {
            Place::Accumulator => self.acc,
            Place::Direct(address) => self.read_direct(address, bus),
            Place::Ram(index) => self.iram[usize::from(index)],
        }
    }

    fn write<B: Bus>(&mut self, place: Place, value: u8, bus: &mut B) {
        match place {
            Place::Accumulator => self.acc = value,
            Place::Direct(address) => self.write_direct(address, value, bus),
            Place::Ram(index) => self.iram[usize::from(index)] = value,
        }
    }

    fn read_direct<B: Bus>(&mut self, address: u8, bus: &mut B) -> u8 {
        if address < 0x80 {
            return self.iram[usize::from(address)];
        }
        self.sfr(address).unwrap_or_else(|| bus.read_sfr(address))
    }

    /// As `read_direct`, for an instruction that writes back.
    fn read_latch<B: Bus>(&mut self, address: u8, bus: &mut B) -> u8 {
        if address < 0x80 {
            return self.iram[usize::from(address)];
        }
        self.sfr(address).unwrap_or_else(|| bus.read_sfr_latch(address))
    }

    fn write_direct<B: Bus>(&mut self, address: u8, value: u8, bus: &mut B) {
        if address < 0x80 {
            self.iram[usize::from(address)] = value;
        } else if !self.set_sfr(address, value) {
            bus.write_sfr(address, value);
        } else {
            match address {
                sfr::IE | sfr::IP | sfr::EIE | sfr::EIP => self.hold = true,
                sfr::CKCON | sfr::PCON => bus.write_sfr(address, value),
                _ => {}
            }
        }
    }

    fn dptr(&self) -> u16 {
        self.dptr[usize::from(self.dps & 1)]
    }

    fn dptr_mut(&mut self) -> &mut u16 {
        &mut self.dptr[usize::from(self.dps & 1)]
    }

    /// The address of MOVX @Ri.
    fn paged_address(&self, opcode: u8) -> u16 {
        u16::from_be_bytes([self.mpage, self.iram[self.register(opcode & 1)]])
    }

    fn carry(&self) -> bool {
        self.psw & CY != 0
    }

    fn set_flags(&mut self, which: u8, flags: u8) {
        self.psw = self.psw & !which | flags;
    }

    fn set_carry(&mut self, carry: bool) {
        self.set_flags(CY, if carry { CY } else { 0 });
    }

    // Arithmetic.

    fn add(&mut self, value: u8, carry: bool) {
        let (a, b, c) = (u16::from(self.acc), u16::from(value), u16::from(carry));
        let sum = a + b + c;
        let carries = a ^ b ^ sum; // bit n: carry out of bit n-1
        self.acc = sum as u8;
        self.set_carries(carries);
    }

    fn subtract(&mut self, value: u8) {
        let (a, b, c) = (u16::from(self.acc), u16::from(value), u16::from(self.carry()));
        let difference = a.wrapping_sub(b).wrapping_sub(c);
        let borrows = a ^ b ^ difference;
        self.acc = difference as u8;
        self.set_carries(borrows);
    }

    /// CY is the carry out of bit 7, AC out of bit 3, OV that those of bits 7 and 6 differ.
    fn set_carries(&mut self, carries: u16) {
        let cy = (carries >> 1) as u8 & CY;
        let ac = (carries << 2) as u8 & AC;
        let ov = ((carries >> 6) ^ (carries >> 5)) as u8 & OV;
        self.set_flags(CY | AC | OV, cy | ac | ov);
    }

    fn multiply(&mut self) {
        let product = u16::from(self.acc) * u16::from(self.b);
        [self.acc, self.b] = product.to_le_bytes();
        self.set_flags(CY | OV, if product > 0xFF { OV } else { 0 });
    }

    /// Division by zero sets OV; what it leaves in A and B is undefined, here: what they held.
    fn divide(&mut self) {
        if self.b == 0 {
            self.set_flags(CY | OV, OV);
            return;
        }
        (self.acc, self.b) = (self.acc / self.b, self.acc % self.b);
        self.set_flags(CY | OV, 0);
    }

    /// Never clears CY: a carry from the addition before counts as the third digit.
    fn decimal_adjust(&mut self) {
        let mut value = u16::from(self.acc);
        if value & 0x0F > 9 || self.psw & AC != 0 {
            value += 0x06;
        }
        if value > 0x9F || self.carry() {
            value += 0x60;
        }
        if value > 0xFF {
            self.set_carry(true);
        }
        self.acc = value as u8;
    }

    fn rotate_through_carry(&mut self, carry_out: bool, rotate: impl Fn(u8, u8) -> u8) {
        self.acc = rotate(self.acc, u8::from(self.carry()));
        self.set_carry(carry_out);
    }

    fn exchange_digit(&mut self, opcode: u8) {
        let index = usize::from(self.iram[self.register(opcode & 1)]);
        let (acc, ram) = (self.acc, self.iram[index]);
        self.acc = acc & 0xF0 | ram & 0x0F;
        self.iram[index] = ram & 0xF0 | acc & 0x0F;
    }

    // Read, modify, write.

    fn modify<B: Bus>(&mut self, opcode: u8, bus: &mut B, change: impl Fn(u8) -> u8) {
        match self.place(opcode, bus) {
            Place::Accumulator => self.acc = change(self.acc),
            Place::Direct(address) => {
                let value = change(self.read_latch(address, bus));
                self.write_direct(address, value, bus);
            }
            Place::Ram(index) => {
                let byte = &mut self.iram[usize::from(index)];
                *byte = change(*byte);
            }
        }
    }

    fn modify_direct<B: Bus>(&mut self, bus: &mut B, change: impl Fn(u8, u8) -> u8) {
        let address = self.fetch(bus);
        let value = change(self.read_latch(address, bus), self.acc);
        self.write_direct(address, value, bus);
    }

    fn modify_direct_constant<B: Bus>(&mut self, bus: &mut B, change: impl Fn(u8, u8) -> u8) {
        let address = self.fetch(bus);
        let constant = self.fetch(bus);
        let value = change(self.read_latch(address, bus), constant);
        self.write_direct(address, value, bus);
    }

    /// The direct address that holds a bit, and the bit in it: RAM 0x20..=0x2F, above the special
    /// function registers at multiples of 8.
    fn bit_place(bit_address: u8) -> (u8, u8) {
        let mask = 1 << (bit_address & 7);
        let byte = if bit_address < 0x80 { 0x20 + (bit_address >> 3) } else { bit_address & 0xF8 };
        (byte, mask)
    }

    fn fetch_bit<B: Bus>(&mut self, bus: &mut B) -> bool {
        let (address, mask) = Self::bit_place(self.fetch(bus));
        self.read_direct(address, bus) & mask != 0
    }

    fn carry_with_bit<B: Bus>(&mut self, bus: &mut B, combine: impl Fn(bool, bool) -> bool) {
        let bit = self.fetch_bit(bus);
        self.set_carry(combine(self.carry(), bit));
    }

    /// Replaces a bit by what `change` makes of it and of CY.
    fn modify_bit<B: Bus>(&mut self, bus: &mut B, change: impl Fn(bool, bool) -> bool) {
        let (address, mask) = Self::bit_place(self.fetch(bus));
        let byte = self.read_latch(address, bus);
        let bit = change(byte & mask != 0, self.carry());
        self.write_direct(address, if bit { byte | mask } else { byte & !mask }, bus);
    }

    // Jumps and the stack.

    fn branch<B: Bus>(&mut self, condition: bool, bus: &mut B) {
        let offset = self.fetch(bus).cast_signed();
        if condition {
            self.pc = self.pc.wrapping_add_signed(i16::from(offset));
        }
    }

    fn jump_on_bit<B: Bus>(&mut self, wanted: bool, bus: &mut B) {
        let bit = self.fetch_bit(bus);
        self.branch(bit == wanted, bus);
    }

    fn jump_on_bit_and_clear<B: Bus>(&mut self, bus: &mut B) {
        let (address, mask) = Self::bit_place(self.fetch(bus));
        let byte = self.read_latch(address, bus);
        if byte & mask != 0 {
            self.write_direct(address, byte & !mask, bus);
        }
        self.branch(byte & mask != 0, bus);
    }

    /// CJNE: A against a constant or direct byte, @Ri or Rn against a constant.
    fn compare_jump<B: Bus>(&mut self, opcode: u8, bus: &mut B) {
        let (left, right) = if opcode & 0x0F < 6 {
            (self.acc, self.operand(opcode, bus))
        } else {
            let place = self.place(opcode, bus);
            (self.read(place, bus), self.fetch(bus))
        };
        self.set_carry(left < right);
        self.branch(left != right, bus);
    }

    fn decrement_jump<B: Bus>(&mut self, opcode: u8, bus: &mut B) {
        let place = self.place(opcode, bus);
        let value = match place {
            Place::Direct(address) => self.read_latch(address, bus),
            _ => self.read(place, bus),
        };
        let value = value.wrapping_sub(1);
        self.write(place, value, bus);
        self.branch(value != 0, bus);
    }

    /// AJMP and ACALL: the opcode's upper three bits are address bits 10..8.
    fn jump_in_page<B: Bus>(&mut self, opcode: u8, bus: &mut B) {
        let low = self.fetch(bus);
        let target = self.pc & 0xF800 | u16::from(opcode >> 5) << 8 | u16::from(low);
        if opcode & 0x10 != 0 {
            self.call(target);
        } else {
            self.pc = target;
        }
    }

    pub(crate) fn call(&mut self, target: u16) {
        let [low, high] = self.pc.to_le_bytes();
        self.push(low);
        self.push(high);
        self.pc = target;
    }

    fn pop_address(&mut self) -> u16 {
        let high = self.pop();
        u16::from_be_bytes([high, self.pop()])
    }

    fn push(&mut self, value: u8) {
        self.sp = self.sp.wrapping_add(1);
        self.iram[usize::from(self.sp)] = value;
    }

    fn pop(&mut self) -> u8 {
        let value = self.iram[usize::from(self.sp)];
        self.sp = self.sp.wrapping_sub(1);
        value
    }

    /// PUSH SP stores the incremented pointer: the increment comes first.
    fn push_direct<B: Bus>(&mut self, bus: &mut B) {
        let address = self.fetch(bus);
        self.sp = self.sp.wrapping_add(1);
        self.iram[usize::from(self.sp)] = self.read_direct(address, bus);
    }

    /// POP SP: the popped byte wins over the decrement.
    fn pop_direct<B: Bus>(&mut self, bus: &mut B) {
        let address = self.fetch(bus);
        let value = self.pop();
        self.write_direct(address, value, bus);
    }

    fn return_from_interrupt(&mut self) {
        self.pc = self.pop_address();
        self.end_service();
        self.hold = true;
    }
}
