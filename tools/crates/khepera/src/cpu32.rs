//! The CPU32 as the m68k crate's 68EC020 with what differs put right: address errors on odd
//! operands, its own fault frame, no bit-field, CAS and PACK instructions, LPSTOP.
//!
//! Approximate: cycle counts (the larger of the 68020's table and the 16-bit bus cycles), and
//! faulted instructions, which are restarted from scratch where a CPU32 reruns the bus cycle. TBL
//! instructions and memory-indirect addressing are not looked at: the former raise Line-F, the
//! latter work although a CPU32 has none.

use m68k::core::cpu::SFLAG_SET;
use m68k::{AddressBus, CpuCore, CpuType, StepResult};

use crate::bus::{Bus, Fault};
use crate::turret_bus::TurretBus;

const ADDRESS_MASK: u32 = 0x00FF_FFFF;
/// T1, T0, S, interrupt mask and condition codes: no master state.
const SR_MASK: u32 = 0xE71F;
const LPSTOP: [u16; 2] = [0xF800, 0x01C0];
const RTE: u32 = 0x4E73;
const FORMAT_ERROR: u32 = 14;
const ILLEGAL: u32 = 4;
const BUS_ERROR: u32 = 2;
const ADDRESS_ERROR: u32 = 3;
/// Bytes of the fault frame of format $C.
const FAULT_FRAME_BYTES: u32 = 24;
/// Internal clocks of an exception beyond its bus cycles.
const EXCEPTION_CLOCKS: u64 = 14;

/// What the CPU is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CpuState {
    /// Executing instructions.
    Running,
    /// Waiting for an interrupt in STOP or LPSTOP.
    Stopped,
    /// Halted by a double bus fault; only a reset helps.
    Halted,
    /// Waiting for an answer on the bus that never comes; only a reset helps.
    Hung,
    /// Held in reset, or without supply.
    Held,
}

/// The CPU.
#[derive(Debug)]
pub(crate) struct Cpu {
    core: CpuCore,
    pub state: CpuState,
    pub instructions: u64,
    pub exceptions: u64,
}

impl Clone for Cpu {
    /// All that lasts from one instruction to the next.
    fn clone(&self) -> Self {
        let from = &self.core;
        let mut core = new_core();
        core.dar = from.dar;
        core.dar_save = from.dar_save;
        core.sr_save = from.sr_save;
        core.ppc = from.ppc;
        core.pc = from.pc;
        core.sp = from.sp;
        core.vbr = from.vbr;
        core.sfc = from.sfc;
        core.dfc = from.dfc;
        core.cacr = from.cacr;
        core.caar = from.caar;
        core.ir = from.ir;
        core.t1_flag = from.t1_flag;
        core.t0_flag = from.t0_flag;
        core.s_flag = from.s_flag;
        core.m_flag = from.m_flag;
        core.x_flag = from.x_flag;
        core.n_flag = from.n_flag;
        core.not_z_flag = from.not_z_flag;
        core.v_flag = from.v_flag;
        core.c_flag = from.c_flag;
        core.int_mask = from.int_mask;
        core.stopped = from.stopped;
        core.run_mode = from.run_mode;
        core.exception_processing = from.exception_processing;
        Self {
            core,
            state: self.state,
            instructions: self.instructions,
            exceptions: self.exceptions,
        }
    }
}

fn new_core() -> CpuCore {
    let mut core = CpuCore::new();
    core.set_cpu_type(CpuType::M68EC020);
    core.address_mask = ADDRESS_MASK;
    core.sr_mask = SR_MASK;
    core.fpu_present = false;
    core
}

/// MOVEC's control registers: SFC, DFC, USP, VBR. The 68020's others are illegal on a CPU32.
fn control_register(extension: u16) -> bool {
    matches!(extension & 0xFFF, 0x000 | 0x001 | 0x800 | 0x801)
}

/// Instructions of the 68020 that a CPU32 lacks: CALLM, RTM, CAS, CAS2, PACK, UNPK, bit fields, and
/// MOVEC of registers that it has not.
fn lacking(opcode: u16, extension: impl FnOnce() -> Option<u16>) -> bool {
    match opcode >> 12 {
        0x4 => opcode & 0xFFFE == 0x4E7A && extension().is_some_and(|e| !control_register(e)),
        0x0 => opcode & 0xFFC0 == 0x06C0 || opcode & 0xF9C0 == 0x08C0 && opcode & 0x0600 != 0,
        0x8 => matches!(opcode & 0x01F0, 0x0140 | 0x0180),
        0xE => opcode & 0x08C0 == 0x08C0,
        _ => false,
    }
}

impl Cpu {
    pub fn new() -> Self {
        Self { core: new_core(), state: CpuState::Running, instructions: 0, exceptions: 0 }
    }

    pub fn pc(&self) -> u32 {
        self.core.pc
    }

    pub fn sr(&self) -> u16 {
        self.core.get_sr()
    }

    /// D0..D7, A0..A7.
    pub fn registers(&self) -> [u32; 16] {
        self.core.dar
    }

    pub fn reset<T: TurretBus>(&mut self, bus: &mut Bus<'_, T>) {
        self.state = CpuState::Running;
        self.core.exception_processing = false;
        self.core.reset(bus);
        self.core.last_exception_vector = None;
        if bus.soc.fault.take().is_some() {
            self.state = CpuState::Halted;
        }
    }

    /// Whether an interrupt of `level` is taken now.
    #[inline]
    pub fn takes(&self, level: u8) -> bool {
        u32::from(level) > self.core.int_mask >> 8 || level == 7
    }

    /// What the fault handling goes back to when it comes before or after an instruction.
    fn mark(&mut self) {
        self.core.dar_save = self.core.dar;
        self.core.sr_save = self.core.get_sr();
    }

    fn enter_supervisor(&mut self) {
        self.core.t1_flag = 0;
        self.core.t0_flag = 0;
        self.core.set_s_flag(SFLAG_SET);
    }

    /// Interrupt exception with a frame of format $0.
    pub fn interrupt<T: TurretBus>(&mut self, bus: &mut Bus<'_, T>, level: u8) {
        self.mark();
        self.core.ppc = self.core.pc;
        let sr = self.core.sr_save;
        self.enter_supervisor();
        self.core.int_mask = u32::from(level) << 8;
        let vector = u32::from(bus.soc.acknowledge(level));
        let pc = self.core.pc;
        self.core.push_16(bus, (vector << 2) as u16);
        self.core.push_32(bus, pc);
        self.core.push_16(bus, sr);
        self.core.jump_vector(bus, vector);
        self.core.stopped = 0;
        self.state = CpuState::Running;
        self.exceptions += 1;
        bus.soc.clk += EXCEPTION_CLOCKS;
        self.finish(bus);
    }

    /// One instruction, or the exception that it raises.
    #[inline]
    pub fn step<T: TurretBus>(&mut self, bus: &mut Bus<'_, T>) {
        let pc = self.core.pc;
        bus.soc.pc = pc;
        if pc & 1 != 0 {
            self.odd_program_counter(bus, pc);
            return;
        }
        let start = bus.soc.clk;
        let memory = &bus.soc.memory;
        let extension = || memory.peek_word(pc.wrapping_add(2));
        if memory.peek_word(pc).is_some_and(|opcode| lacking(opcode, extension)) {
            self.core.ppc = pc;
            self.mark();
            self.core.take_exception(bus, ILLEGAL);
        } else {
            let result = self.core.step(bus);
            let cycles = match result {
                StepResult::Ok { cycles } => cycles,
                other => self.trap(bus, other),
            };
            bus.soc.clk = bus.soc.clk.max(start + cycles.max(0) as u64);
        }
        self.instructions += 1;
        if self.core.pc != bus.soc.fetched_to {
            bus.soc.clk += bus.soc.fetch_clocks; // the prefetch after a jump, thrown away
        }
        if self.core.last_exception_vector.is_some() || self.core.stopped != 0 {
            self.exceptional(bus);
        } else if bus.soc.fault.is_some() {
            self.finish(bus);
        }
    }

    #[cold]
    fn exceptional<T: TurretBus>(&mut self, bus: &mut Bus<'_, T>) {
        let vector = self.core.last_exception_vector.take();
        if vector == Some(FORMAT_ERROR) && self.core.ir == RTE && bus.soc.fault.is_none() {
            self.return_from_fault(bus);
        }
        if vector.is_some() {
            self.exceptions += 1;
            bus.soc.clk += EXCEPTION_CLOCKS;
        }
        self.finish(bus);
        if self.core.stopped != 0 && self.state == CpuState::Running {
            self.state = CpuState::Stopped;
        }
    }

    /// Traps that the crate leaves to its host; their cycles.
    fn trap<T: TurretBus>(&mut self, bus: &mut Bus<'_, T>, trap: StepResult) -> i32 {
        if trap == (StepResult::FlineTrap { opcode: LPSTOP[0] }) && self.low_power_stop(bus) {
            return 0;
        }
        self.mark();
        match trap {
            StepResult::Ok { cycles } => cycles,
            StepResult::AlineTrap { .. } => self.core.take_aline_exception(bus),
            StepResult::FlineTrap { .. } => self.core.take_fline_exception(bus),
            StepResult::TrapInstruction { trap_num } => {
                self.core.take_trap_exception(bus, trap_num)
            }
            StepResult::Breakpoint { .. } => self.core.take_bkpt_exception(bus),
            StepResult::IllegalInstruction { .. } => self.core.take_illegal_exception(bus),
            StepResult::Stopped => 0,
        }
    }

    /// LPSTOP #sr: like STOP, with the clocks stopped as well. False if it is another instruction or
    /// not allowed here.
    fn low_power_stop<T: TurretBus>(&mut self, bus: &mut Bus<'_, T>) -> bool {
        let pc = self.core.pc;
        if bus.soc.memory.peek_word(pc) != Some(LPSTOP[1]) || !self.core.is_supervisor() {
            return false;
        }
        let Some(sr) = bus.soc.memory.peek_word(pc.wrapping_add(2)) else { return false };
        bus.soc.warn(pc, false, "LPSTOP: QSM and GPT go on here, in the chip their clocks stop");
        self.core.pc = pc.wrapping_add(4);
        self.core.stop(sr);
        true
    }

    fn odd_program_counter<T: TurretBus>(&mut self, bus: &mut Bus<'_, T>, pc: u32) {
        self.mark();
        self.core.ppc = pc;
        bus.soc.warn(pc, false, "odd program counter: address error");
        bus.soc.fault = Some(Fault {
            address: pc,
            write: false,
            size: 2,
            instruction: true,
            odd: true,
            hangs: false,
        });
        self.finish(bus);
    }

    /// Deal with a fault left by an instruction or by exception processing.
    fn finish<T: TurretBus>(&mut self, bus: &mut Bus<'_, T>) {
        let Some(fault) = bus.soc.fault.take() else { return };
        self.core.run_mode = 0;
        self.core.stopped = 0;
        self.core.exception_processing = false;
        if fault.hangs {
            self.state = CpuState::Hung;
            return;
        }
        self.push_fault_frame(bus, fault);
        let vector = if fault.odd { ADDRESS_ERROR } else { BUS_ERROR };
        self.core.jump_vector(bus, vector);
        self.core.last_exception_vector = None;
        self.exceptions += 1;
        bus.soc.clk += EXCEPTION_CLOCKS;
        if bus.soc.fault.take().is_some() {
            self.core.run_mode = 0;
            self.core.stopped = 0;
            self.core.exception_processing = false;
            self.state = CpuState::Halted;
        }
    }

    /// CPU32RM 6.3: SR, PC, format $C and vector, faulted address, data buffer, PC of the
    /// instruction, internal transfer count, special status word. The data buffer and the transfer
    /// count are left 0.
    fn push_fault_frame<T: TurretBus>(&mut self, bus: &mut Bus<'_, T>, fault: Fault) {
        let sr = self.core.sr_save;
        self.core.dar = self.core.dar_save;
        self.core.set_sr_noint_nosp(sr);
        let pc = self.core.ppc;
        let supervisor = self.core.is_supervisor();
        self.enter_supervisor();
        let vector = if fault.odd { ADDRESS_ERROR } else { BUS_ERROR } as u16;
        self.core.push_16(bus, special_status(fault, supervisor));
        self.core.push_16(bus, 0);
        self.core.push_32(bus, pc);
        self.core.push_32(bus, 0);
        self.core.push_32(bus, fault.address);
        self.core.push_16(bus, 0xC000 | vector << 2);
        self.core.push_32(bus, pc);
        self.core.push_16(bus, sr);
    }

    /// RTE from a frame of format $C, which the crate's 68020 refuses: the instruction starts again.
    fn return_from_fault<T: TurretBus>(&mut self, bus: &mut Bus<'_, T>) {
        let frame = self.core.dar_save[15];
        let format = bus.read_word(frame.wrapping_add(6));
        if format >> 12 != 0xC {
            return;
        }
        let sr = bus.read_word(frame);
        let pc = bus.read_long(frame.wrapping_add(2));
        self.core.dar = self.core.dar_save;
        self.core.dar[15] = frame.wrapping_add(FAULT_FRAME_BYTES);
        self.core.pc = pc;
        self.core.set_sr(sr);
    }
}

/// The special status word: IN (7), RW (6, 1 = read), LG (5), SIZ (4:3), function code (2:0).
fn special_status(fault: Fault, supervisor: bool) -> u16 {
    let space = match (fault.instruction, supervisor) {
        (true, true) => 6,
        (true, false) => 2,
        (false, true) => 5,
        (false, false) => 1,
    };
    let size = match fault.size {
        1 => 1 << 3,
        2 => 2 << 3,
        _ => 0,
    };
    u16::from(fault.instruction) << 7
        | u16::from(!fault.write) << 6
        | u16::from(fault.size == 4) << 5
        | size
        | space
}

#[cfg(test)]
mod tests {
    use super::lacking;

    #[test]
    fn opcodes_of_the_68020_only_are_told_from_their_neighbours() {
        // bfffo, bfextu, cas.b, cas.l, cas2, callm, rtm, pack, unpk
        for opcode in [0xEDC0, 0xE9C0, 0x0AD0, 0x0ED0, 0x0CFC, 0x06D0, 0x06C1, 0x8141, 0x8189] {
            assert!(lacking(opcode, || None), "{opcode:#06x}");
        }
        // lsl.w, asr memory, bset #, btst, moves.l, addi.l, sbcd, or.w, divu.w, ror.l
        for opcode in [
            0xE148, 0xE0D0, 0x08C0, 0x0800, 0x0E90, 0x0690, 0x8101, 0x8050, 0x80C1, 0xE098, 0xE6D0,
            0xE7D0, 0x08D0,
        ] {
            assert!(!lacking(opcode, || None), "{opcode:#06x}");
        }
        // movec vbr, usp; movec cacr, msp
        assert!(!lacking(0x4E7A, || Some(0x0801)) && !lacking(0x4E7B, || Some(0x8800)));
        assert!(lacking(0x4E7A, || Some(0x0002)) && lacking(0x4E7B, || Some(0x8803)));
    }
}
