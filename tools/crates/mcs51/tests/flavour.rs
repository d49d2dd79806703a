//! What makes this core the FX2's and what ucsim cannot check: MPAGE, interrupts, IDLE, reserved
//! bits, port latches.

use mcs51::{Bus, Cpu, Source, sfr};

const ISR_RETI: u8 = 0x32;
const EA: u8 = 0x80;

/// 64 KB of code and xdata; registers that read 0x55 at the pins and 0xAA in the latch.
struct Board {
    code: Vec<u8>,
    xdata: Vec<u8>,
    sfr_writes: Vec<(u8, u8)>,
    acknowledged: Vec<Source>,
}

impl Bus for Board {
    fn read_code(&mut self, address: u16) -> u8 {
        self.code[usize::from(address)]
    }
    fn read_xdata(&mut self, address: u16) -> u8 {
        self.xdata[usize::from(address)]
    }
    fn write_xdata(&mut self, address: u16, value: u8) {
        self.xdata[usize::from(address)] = value;
    }
    fn read_sfr(&mut self, _address: u8) -> u8 {
        0x55
    }
    fn read_sfr_latch(&mut self, _address: u8) -> u8 {
        0xAA
    }
    fn write_sfr(&mut self, address: u8, value: u8) {
        self.sfr_writes.push((address, value));
    }
    fn acknowledge(&mut self, source: Source) {
        self.acknowledged.push(source);
    }
}

/// A core at 0x1000 with `program` there and NOP (0x00) everywhere else.
fn start(program: &[u8]) -> (Cpu, Board) {
    let mut board = Board {
        code: vec![0; 0x1_0000],
        xdata: vec![0; 0x1_0000],
        sfr_writes: Vec::new(),
        acknowledged: Vec::new(),
    };
    board.code[0x1000..0x1000 + program.len()].copy_from_slice(program);
    let mut cpu = Cpu::new();
    cpu.set_pc(0x1000);
    (cpu, board)
}

fn enable_all(cpu: &mut Cpu) {
    cpu.set_sfr(sfr::IE, 0xFF);
    cpu.set_sfr(sfr::EIE, 0xFF);
}

fn set_high_priority(cpu: &mut Cpu, source: Source) {
    let (register, bit) = control_bit(source);
    let register = if register == sfr::IE { sfr::IP } else { sfr::EIP };
    let value = cpu.sfr(register).expect("a core register") | 1 << bit;
    cpu.set_sfr(register, value);
}

/// The enable register of a source and its bit there. TRM table 4-9.
fn control_bit(source: Source) -> (u8, u8) {
    match source {
        Source::Int0 => (sfr::IE, 0),
        Source::Timer0 => (sfr::IE, 1),
        Source::Int1 => (sfr::IE, 2),
        Source::Timer1 => (sfr::IE, 3),
        Source::Serial0 => (sfr::IE, 4),
        Source::Timer2 => (sfr::IE, 5),
        Source::Serial1 => (sfr::IE, 6),
        Source::Int2Usb => (sfr::EIE, 0),
        Source::I2c => (sfr::EIE, 1),
        Source::Int4Fifo => (sfr::EIE, 2),
        Source::Int5 => (sfr::EIE, 3),
        Source::Int6 => (sfr::EIE, 4),
        Source::Resume => panic!("the chip holds the enable bit of resume"),
    }
}

fn maskable() -> impl Iterator<Item = Source> {
    Source::ALL.into_iter().filter(|&source| source != Source::Resume)
}

#[test]
fn mpage_is_the_high_byte_of_movx_through_r0_and_r1() {
    // MOV MPAGE,#0x12; MOV R0,#0x34; MOV R1,#0x56; MOVX A,@R0; MOVX @R1,A
    let (mut cpu, mut board) = start(&[0x75, sfr::MPAGE, 0x12, 0x78, 0x34, 0x79, 0x56, 0xE2, 0xF3]);
    board.xdata[0x1234] = 0x77;
    for _ in 0..5 {
        cpu.step(&mut board);
    }
    assert_eq!(board.xdata[0x1256], 0x77);
    assert!(board.sfr_writes.is_empty(), "MPAGE is the core's");
}

#[test]
fn movc_wraps_around_64_kilobytes() {
    // MOVC A,@A+DPTR
    let (mut cpu, mut board) = start(&[0x93]);
    cpu.set_sfr(sfr::DPH0, 0xFF);
    cpu.set_sfr(sfr::DPL0, 0xF0);
    cpu.set_sfr(sfr::ACC, 0x20);
    board.code[0x0010] = 0x77;
    cpu.step(&mut board);
    assert_eq!(cpu.sfr(sfr::ACC), Some(0x77));
}

#[test]
fn parity_follows_the_accumulator_whatever_is_written() {
    // MOV A,#1; MOV PSW,#0; MOV A,#3; MOV PSW,#0xFF
    let (mut cpu, mut board) =
        start(&[0x74, 0x01, 0x75, sfr::PSW, 0x00, 0x74, 0x03, 0x75, sfr::PSW, 0xFF]);
    cpu.step(&mut board);
    cpu.step(&mut board);
    assert_eq!(cpu.sfr(sfr::PSW), Some(0x01));
    cpu.step(&mut board);
    cpu.step(&mut board);
    assert_eq!(cpu.sfr(sfr::PSW), Some(0xFE));
}

/// Which bits are reserved, and how they read, is from memory of the manual: an assumption of ours.
#[test]
fn reserved_bits_read_as_assumed() {
    let mut cpu = Cpu::new();
    for (register, zeros, ones) in [
        (sfr::DPS, 0x00, 0x01),
        (sfr::PCON, 0x30, 0xFF),
        (sfr::IP, 0x80, 0xFF),
        (sfr::EIE, 0xE0, 0xFF),
        (sfr::EIP, 0xE0, 0xFF),
    ] {
        cpu.set_sfr(register, 0x00);
        assert_eq!(cpu.sfr(register), Some(zeros), "{register:02X}");
        cpu.set_sfr(register, 0xFF);
        assert_eq!(cpu.sfr(register), Some(ones), "{register:02X}");
    }
}

#[test]
fn reset_restores_registers_and_keeps_ram_and_requests() {
    let (mut cpu, _) = start(&[]);
    enable_all(&mut cpu);
    cpu.set_sfr(sfr::CKCON, 0);
    cpu.iram_mut()[0x80] = 0x77;
    cpu.requests = Source::Timer0.mask();
    cpu.reset();
    assert_eq!((cpu.pc(), cpu.sfr(sfr::SP), cpu.sfr(sfr::CKCON)), (0, Some(0x07), Some(0x01)));
    assert_eq!(cpu.iram()[0x80], 0x77);
    assert_eq!(cpu.requests, Source::Timer0.mask());
    assert_eq!(cpu.next_interrupt(), None);
}

#[test]
fn the_bus_hears_of_ckcon_and_pcon() {
    // MOV CKCON,#0x38; ORL PCON,#0x80; MOV IE,#1
    let (mut cpu, mut board) =
        start(&[0x75, sfr::CKCON, 0x38, 0x43, sfr::PCON, 0x80, 0x75, sfr::IE, 0x01]);
    for _ in 0..3 {
        cpu.step(&mut board);
    }
    assert_eq!(board.sfr_writes, [(sfr::CKCON, 0x38), (sfr::PCON, 0xB0)]);
}

#[test]
fn instructions_that_write_back_read_the_latch() {
    const PORT: u8 = 0x80;
    let latch: [&[u8]; 14] = [
        &[0x05, PORT],
        &[0x15, PORT],
        &[0x42, PORT],
        &[0x43, PORT, 0],
        &[0x52, PORT],
        &[0x53, PORT, 0xFF],
        &[0x62, PORT],
        &[0x63, PORT, 0],
        &[0x92, PORT],
        &[0xB2, PORT],
        &[0xC2, PORT],
        &[0xD2, PORT],
        &[0xD5, PORT, 0],
        &[0x10, PORT | 1, 0],
    ];
    // With A = 0 and CY = 0, from the latch value 0xAA.
    let written =
        [0xAB, 0xA9, 0xAA, 0xAA, 0x00, 0xAA, 0xAA, 0xAA, 0xAA, 0xAB, 0xAA, 0xAB, 0xA9, 0xA8];
    for (program, value) in latch.into_iter().zip(written) {
        let (mut cpu, mut board) = start(program);
        cpu.step(&mut board);
        assert_eq!(board.sfr_writes, [(PORT, value)], "{program:02X?}");
    }
}

#[test]
fn other_instructions_read_the_pins() {
    const PORT: u8 = 0x80;
    // MOV A,P; ADD A,P; XCH A,P
    for program in [[0xE5, PORT], [0x25, PORT], [0xC5, PORT]] {
        let (mut cpu, mut board) = start(&program);
        cpu.step(&mut board);
        assert_eq!(cpu.sfr(sfr::ACC), Some(0x55), "{program:02X?}");
    }
    let (mut cpu, mut board) = start(&[0xA2, PORT]); // MOV C,P.0
    cpu.step(&mut board);
    assert_eq!(cpu.sfr(sfr::PSW), Some(0x80));
    let (mut cpu, mut board) = start(&[0x20, PORT, 0x10]); // JB P.0
    cpu.step(&mut board);
    assert_eq!(cpu.pc(), 0x1013);
}

#[test]
fn every_source_calls_its_vector_when_enabled() {
    for source in maskable() {
        let (mut cpu, mut board) = start(&[]);
        let (register, bit) = control_bit(source);
        cpu.requests = source.mask();
        cpu.set_sfr(sfr::IE, EA);
        assert_eq!(cpu.next_interrupt(), None, "{source:?} is masked");
        let value = cpu.sfr(register).expect("a core register") | 1 << bit;
        cpu.set_sfr(register, value);
        assert_eq!(cpu.step(&mut board), 4, "an LCALL");
        assert_eq!(cpu.pc(), 8 * source as u16 + 3, "{source:?}");
        assert_eq!(cpu.iram()[0x08..0x0A], [0x00, 0x10], "the return address");
        assert_eq!(board.acknowledged, [source]);
    }
}

#[test]
fn ea_masks_everything_but_resume() {
    let (mut cpu, mut board) = start(&[]);
    enable_all(&mut cpu);
    cpu.set_sfr(sfr::IE, 0x7F);
    cpu.requests = 0x1FFF & !Source::Resume.mask();
    assert_eq!(cpu.next_interrupt(), None);
    cpu.requests = 0x1FFF;
    cpu.step(&mut board);
    assert_eq!(cpu.pc(), 0x0033);
}

#[test]
fn equal_priorities_are_served_in_natural_order() {
    let (mut cpu, mut board) = start(&[]);
    for vector in Source::ALL.map(Source::vector) {
        board.code[usize::from(vector)] = ISR_RETI;
    }
    enable_all(&mut cpu);
    cpu.requests = 0x1FFF;
    while cpu.requests != 0 {
        cpu.step(&mut board);
        let served = board.acknowledged.iter().fold(0, |mask, source| mask | source.mask());
        cpu.requests = 0x1FFF & !served;
    }
    let order: Vec<Source> = std::iter::once(Source::Resume).chain(maskable()).collect();
    assert_eq!(board.acknowledged, order);
}

#[test]
fn high_priority_goes_first_and_interrupts_low() {
    for high in maskable() {
        let (mut cpu, mut board) = start(&[]);
        enable_all(&mut cpu);
        set_high_priority(&mut cpu, high);
        cpu.requests = 0x1FFF & !Source::Resume.mask();
        assert_eq!(cpu.next_interrupt(), Some(high));
        cpu.requests &= !high.mask();
        cpu.step(&mut board); // a low one is in service now
        assert_eq!(cpu.next_interrupt(), None, "low does not interrupt low");
        cpu.requests |= high.mask();
        assert_eq!(cpu.next_interrupt(), Some(high));
    }
}

#[test]
fn levels_nest_and_return_in_order() {
    let (mut cpu, mut board) = start(&[]);
    for vector in Source::ALL.map(Source::vector) {
        board.code[usize::from(vector)] = ISR_RETI;
    }
    enable_all(&mut cpu);
    set_high_priority(&mut cpu, Source::Int2Usb);
    set_high_priority(&mut cpu, Source::I2c);
    for source in [Source::Timer0, Source::I2c, Source::Resume] {
        cpu.requests |= source.mask();
        cpu.step(&mut board);
        assert_eq!(cpu.pc(), source.vector());
    }
    cpu.requests = 0x1FFF;
    assert_eq!(cpu.next_interrupt(), None, "nothing interrupts resume");
    cpu.requests &= !Source::Resume.mask();
    cpu.step(&mut board); // RETI of resume
    assert_eq!((cpu.pc(), cpu.next_interrupt()), (Source::I2c.vector(), None));
    cpu.step(&mut board); // RETI of I2C, after which one instruction must run: timer 0's RETI
    assert_eq!((cpu.pc(), cpu.next_interrupt()), (Source::Timer0.vector(), Some(Source::Int2Usb)));
    cpu.step(&mut board);
    assert_eq!(cpu.pc(), 0x1000);
    cpu.step(&mut board); // NOP, because of that RETI
    assert_eq!(cpu.pc(), 0x1001);
    cpu.step(&mut board);
    assert_eq!(cpu.pc(), Source::Int2Usb.vector());
}

#[test]
fn a_reti_without_interrupt_is_a_ret() {
    let (mut cpu, mut board) = start(&[0x12, 0x20, 0x00]); // LCALL 0x2000
    board.code[0x2000] = ISR_RETI;
    enable_all(&mut cpu);
    assert_eq!(cpu.step(&mut board) + cpu.step(&mut board), 8);
    assert_eq!(cpu.pc(), 0x1003);
}

#[test]
fn one_instruction_runs_after_reti_and_after_writes_of_interrupt_registers() {
    let programs: [&[u8]; 6] = [
        &[ISR_RETI],
        &[0x75, sfr::IE, 0xFF],
        &[0xD2, sfr::IE | 7], // SETB EA
        &[0x43, sfr::IP, 0x00],
        &[0x53, sfr::EIE, 0xFF],
        &[0xF5, sfr::EIP],
    ];
    for program in programs {
        let (mut cpu, mut board) = start(program);
        board.code[0..2].copy_from_slice(&[0x00, 0x00]); // where RETI goes
        enable_all(&mut cpu);
        cpu.step(&mut board);
        cpu.requests = Source::Timer1.mask();
        let next = cpu.pc();
        assert_eq!(cpu.step(&mut board), 1, "{program:02X?}: a NOP");
        assert_eq!(cpu.pc(), next + 1, "{program:02X?}");
        cpu.step(&mut board);
        assert_eq!(cpu.pc(), Source::Timer1.vector(), "{program:02X?}");
    }
}

#[test]
fn reading_an_interrupt_register_delays_nothing() {
    let (mut cpu, mut board) = start(&[0xE5, sfr::IE]);
    enable_all(&mut cpu);
    cpu.step(&mut board);
    cpu.requests = Source::Timer1.mask();
    cpu.step(&mut board);
    assert_eq!(cpu.pc(), Source::Timer1.vector());
}

#[test]
fn idle_waits_for_an_interrupt_and_goes_on_behind_it() {
    // ORL PCON,#1; INC A
    let (mut cpu, mut board) = start(&[0x43, sfr::PCON, 0x01, 0x04]);
    board.code[usize::from(Source::Int2Usb.vector())] = ISR_RETI;
    enable_all(&mut cpu);
    cpu.set_sfr(sfr::EIE, 0x01);
    cpu.step(&mut board);
    cpu.requests = Source::Int5.mask(); // not enabled
    for _ in 0..5 {
        assert_eq!(cpu.step(&mut board), 1);
        assert!(cpu.is_idle());
        assert_eq!(cpu.pc(), 0x1003);
    }
    cpu.requests |= Source::Int2Usb.mask();
    cpu.step(&mut board);
    assert_eq!((cpu.is_idle(), cpu.pc()), (false, Source::Int2Usb.vector()));
    cpu.requests = 0;
    cpu.step(&mut board);
    cpu.step(&mut board);
    assert_eq!(cpu.sfr(sfr::ACC), Some(1));
}

#[test]
fn stretch_lengthens_movx_alone() {
    for stretch in 0..=7 {
        // MOVX A,@DPTR; MOVX @DPTR,A; MOVX A,@R0; MOVX @R1,A; INC DPTR; MOVC A,@A+DPTR
        let (mut cpu, mut board) = start(&[0xE0, 0xF0, 0xE2, 0xF3, 0xA3, 0x93]);
        cpu.set_sfr(sfr::CKCON, stretch | 0xF8);
        let cycles: [u32; 6] = std::array::from_fn(|_| cpu.step(&mut board));
        let movx = 2 + u32::from(stretch);
        assert_eq!(cycles, [movx, movx, movx, movx, 3, 3]);
    }
}

#[test]
fn the_reserved_opcode_does_nothing() {
    let (mut cpu, mut board) = start(&[0xA5]);
    let iram = *cpu.iram();
    assert_eq!(cpu.step(&mut board), 1);
    assert_eq!((cpu.pc(), *cpu.iram() == iram), (0x1001, true));
}
