//! Random programs, made while this core runs them.
//!
//! Code is random bytes. Only operands that would touch a register in which the two machines differ
//! are replaced, just before they are first executed, and before the reference sees any of it.

use mcs51::{Bus, Cpu, Instruction, Operand, sfr};

const CASES: usize = 250;
const STEPS: usize = 60;

/// Port 2, which the reference takes as the high byte of `MOVX @Ri`; the FX2 has MPAGE instead.
pub const P2: u8 = 0xA0;

/// Registers that no random instruction may touch, because they do something in the reference's
/// peripherals or belong to one machine only.
pub const EXCLUDED: [u8; 20] = [
    sfr::PCON, // idles or powers down; reserved bits differ
    0x88,
    0x89,
    0x8A,
    0x8B,
    0x8C,
    0x8D,       // timers 0 and 1 run
    sfr::MPAGE, // the FX2 only: its part is played by P2
    0x98,
    0x99, // serial port sends
    0xB0, // P3: its pins request interrupts
    0xC8,
    0xC9,
    0xCA,
    0xCB,
    0xCC,
    0xCD,
    0xCE,
    0xCF, // timer 2 runs
    0x8F, // reserved in the FX2, a special function in other parts of the family
];

/// Bits in which a core register of the FX2 differs from the plain byte of the reference: parity,
/// which cannot be written, and reserved bits. They are left out of the comparison after a direct
/// write, and the reference is then given our value so that later reads agree.
pub fn reserved_bits(address: u8) -> u8 {
    match address {
        sfr::PSW => 0x01, // the reference keeps a written P until ACC changes
        sfr::DPS => 0xFE,
        sfr::IP => 0x80,
        sfr::EIE | sfr::EIP => 0xE0,
        _ => 0,
    }
}

/// SplitMix64: small, and the same everywhere.
pub struct Random(u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() >> 16) as usize % limit
    }

    fn byte(&mut self) -> u8 {
        self.next() as u8
    }

    fn word(&mut self) -> u16 {
        self.next() as u16
    }

    /// A byte that is often one at which flags change.
    fn edgy_byte(&mut self) -> u8 {
        const EDGES: [u8; 10] = [0x00, 0x01, 0x09, 0x0A, 0x0F, 0x10, 0x7F, 0x80, 0x99, 0xFF];
        if self.below(4) == 0 { EDGES[self.below(EDGES.len())] } else { self.byte() }
    }
}

/// Memories and plain special function registers.
pub struct Memory {
    pub code: Vec<u8>,
    /// Code bytes that were read: they can no longer be replaced.
    read: Vec<bool>,
    pub xdata: Vec<u8>,
    pub sfr: [u8; 256],
    /// Addresses that the current case wrote.
    written_xdata: Vec<u16>,
}

impl Memory {
    /// `code` at address 0, zero everywhere else.
    pub fn new(code: &[u8]) -> Self {
        let mut padded = vec![0; 0x1_0000];
        padded[..code.len()].copy_from_slice(code);
        Self {
            code: padded,
            read: vec![false; 0x1_0000],
            xdata: vec![0; 0x1_0000],
            sfr: [0; 256],
            written_xdata: Vec::new(),
        }
    }
}

impl Bus for Memory {
    fn read_code(&mut self, address: u16) -> u8 {
        self.read[usize::from(address)] = true;
        self.code[usize::from(address)]
    }

    fn read_xdata(&mut self, address: u16) -> u8 {
        self.xdata[usize::from(address)]
    }

    fn write_xdata(&mut self, address: u16, value: u8) {
        self.xdata[usize::from(address)] = value;
        self.written_xdata.push(address);
    }

    fn read_sfr(&mut self, address: u8) -> u8 {
        self.sfr[usize::from(address)]
    }

    fn write_sfr(&mut self, address: u8, value: u8) {
        self.sfr[usize::from(address)] = value;
    }
}

/// What both machines show after an instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Registers {
    pub r: [u8; 8],
    pub acc: u8,
    pub b: u8,
    pub psw: u8,
    pub sp: u8,
    pub dptr: [u16; 2],
    pub dps: u8,
    /// Internal RAM where R0, R1 and SP point.
    pub at_r0: u8,
    pub at_r1: u8,
    pub at_sp: u8,
}

impl Registers {
    pub fn of(cpu: &Cpu) -> Self {
        let sfr = |address| cpu.sfr(address).expect("a core register");
        let iram = |index: u8| cpu.iram()[usize::from(index)];
        let bank = sfr(sfr::PSW) & 0x18;
        let r = std::array::from_fn(|n| iram(bank + n as u8));
        Self {
            r,
            acc: sfr(sfr::ACC),
            b: sfr(sfr::B),
            psw: sfr(sfr::PSW),
            sp: sfr(sfr::SP),
            dptr: [
                u16::from_le_bytes([sfr(sfr::DPL0), sfr(sfr::DPH0)]),
                u16::from_le_bytes([sfr(sfr::DPL1), sfr(sfr::DPH1)]),
            ],
            dps: sfr(sfr::DPS),
            at_r0: iram(r[0]),
            at_r1: iram(r[1]),
            at_sp: iram(sfr(sfr::SP)),
        }
    }
}

/// One executed instruction.
pub struct Step {
    pub address: u16,
    pub opcode: u8,
    pub text: String,
    pub cycles: u32,
    /// PC and registers after it.
    pub pc: u16,
    pub registers: Registers,
    /// A core register with reserved bits that it wrote, and what that then held.
    pub written: Option<(u8, u8)>,
}

/// A start state, some instructions, and what they left.
pub struct Case {
    pub pc: u16,
    pub iram: [u8; 256],
    /// All registers that both machines have: the core's and plain ones.
    pub sfr: Vec<(u8, u8)>,
    pub steps: Vec<Step>,
    pub iram_after: [u8; 256],
    pub sfr_after: Vec<(u8, u8)>,
    /// Sorted addresses and final values.
    pub xdata_after: Vec<(u16, u8)>,
}

/// Cases that share one code and one xdata memory.
pub struct Batch {
    pub code: Vec<u8>,
    pub xdata: Vec<u8>,
    pub cases: Vec<Case>,
    pub xdata_after: Vec<u8>,
}

impl Batch {
    pub fn generate(seed: u64) -> Self {
        let mut random = Random(seed);
        let mut fill = || (0..0x1_0000).map(|_| random.byte()).collect::<Vec<u8>>();
        let (code, xdata) = (fill(), fill());
        let mut memory = Memory::new(&code);
        memory.xdata.clone_from(&xdata);
        let cases = (0..CASES).map(|_| generate_case(&mut random, &mut memory)).collect();
        Self { code: memory.code, xdata, cases, xdata_after: memory.xdata }
    }
}

fn is_shared(address: u8) -> bool {
    address >= 0x80 && !EXCLUDED.contains(&address)
}

fn shared_registers(cpu: &Cpu, memory: &Memory) -> Vec<(u8, u8)> {
    (0x80..=0xFF)
        .filter(|&address| is_shared(address))
        .map(|address| {
            (address, cpu.sfr(address).unwrap_or_else(|| memory.sfr[usize::from(address)]))
        })
        .collect()
}

fn generate_case(random: &mut Random, memory: &mut Memory) -> Case {
    let mut cpu = Cpu::new();
    cpu.iram_mut().fill_with(|| random.edgy_byte());
    for address in (0x80..=0xFF).filter(|&address| is_shared(address)) {
        let value = random.edgy_byte();
        if !cpu.set_sfr(address, value) {
            memory.sfr[usize::from(address)] = value;
        }
    }
    cpu.set_sfr(sfr::MPAGE, memory.sfr[usize::from(P2)]);
    cpu.set_pc(random.word());
    memory.written_xdata.clear();

    let mut case = Case {
        pc: cpu.pc(),
        iram: *cpu.iram(),
        sfr: shared_registers(&cpu, memory),
        steps: Vec::new(),
        iram_after: [0; 256],
        sfr_after: Vec::new(),
        xdata_after: Vec::new(),
    };
    while case.steps.len() < STEPS
        && prepare(random, memory, cpu.pc())
        && !constant_beyond_code(&cpu, memory)
    {
        case.steps.push(run_step(&mut cpu, memory));
    }
    case.iram_after = *cpu.iram();
    case.sfr_after = shared_registers(&cpu, memory);
    memory.written_xdata.sort_unstable();
    memory.written_xdata.dedup();
    case.xdata_after =
        memory.written_xdata.iter().map(|&a| (a, memory.xdata[usize::from(a)])).collect();
    case
}

fn bytes_at(memory: &Memory, address: u16) -> [u8; 3] {
    std::array::from_fn(|n| memory.code[usize::from(address.wrapping_add(n as u16))])
}

/// Replaces operands of the instruction at `address` that both machines cannot share, and some of
/// the others by core registers, which are what direct addressing is about. `false` if that would
/// need a byte which was already read.
fn prepare(random: &mut Random, memory: &mut Memory, address: u16) -> bool {
    let instruction = Instruction::decode(address, bytes_at(memory, address));
    let mut at = address.wrapping_add(1);
    let operands: Vec<Operand> = instruction.operands().collect();
    for operand in operands {
        let index = usize::from(at);
        let register = match operand {
            Operand::Direct(direct) => Some(direct),
            Operand::Bit(bit) => Some(if bit < 0x80 { 0x20 } else { bit & 0xF8 }),
            _ => None,
        };
        if let Some(register) = register.filter(|&register| register >= 0x80) {
            let shared = is_shared(register);
            if memory.read[index] {
                if !shared {
                    return false;
                }
            } else if !shared || random.below(2) == 0 {
                memory.code[index] = replacement(random, operand);
            }
        }
        at = at.wrapping_add(match operand {
            Operand::Constant16(_) => 2,
            _ => 1,
        });
    }
    true
}

/// Whether MOVC is next and its address wraps around 64 KB: the reference reads 0 beyond the end.
fn constant_beyond_code(cpu: &Cpu, memory: &Memory) -> bool {
    let registers = Registers::of(cpu);
    let base = match memory.code[usize::from(cpu.pc())] {
        0x83 => cpu.pc().wrapping_add(1),
        0x93 => registers.dptr[usize::from(registers.dps)],
        _ => return false,
    };
    base.checked_add(registers.acc.into()).is_none()
}

fn replacement(random: &mut Random, operand: Operand) -> u8 {
    const DIRECT: [u8; 9] =
        [sfr::ACC, sfr::B, sfr::PSW, sfr::SP, sfr::DPL0, sfr::DPH0, sfr::DPL1, sfr::DPH1, sfr::DPS];
    const BITS: [u8; 4] = [sfr::ACC, sfr::B, sfr::PSW, P2];
    match operand {
        Operand::Bit(_) => BITS[random.below(BITS.len())] | random.byte() & 7,
        _ => DIRECT[random.below(DIRECT.len())],
    }
}

fn run_step(cpu: &mut Cpu, memory: &mut Memory) -> Step {
    let address = cpu.pc();
    let bytes = bytes_at(memory, address);
    let cycles = cpu.step(memory);
    let target = written_register(bytes);
    if target == Some(P2) {
        cpu.set_sfr(sfr::MPAGE, memory.sfr[usize::from(P2)]);
    }
    Step {
        address,
        opcode: bytes[0],
        text: Instruction::decode(address, bytes).to_string(),
        cycles,
        pc: cpu.pc(),
        registers: Registers::of(cpu),
        written: target
            .filter(|&register| reserved_bits(register) != 0)
            .and_then(|register| Some((register, cpu.sfr(register)?))),
    }
}

/// The special function register that an instruction writes through a direct or bit address.
fn written_register([opcode, first, second]: [u8; 3]) -> Option<u8> {
    let address = match opcode {
        0x05 | 0x15 | 0x42 | 0x43 | 0x52 | 0x53 | 0x62 | 0x63 | 0x75 => first,
        0x86..=0x8F | 0xC5 | 0xD0 | 0xD5 | 0xF5 => first,
        0x85 => second,
        0x10 | 0x92 | 0xB2 | 0xC2 | 0xD2 if first >= 0x80 => first & 0xF8,
        _ => 0,
    };
    (address >= 0x80).then_some(address)
}
