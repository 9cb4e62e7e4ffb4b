//! Decodes one instruction of ARMv7-M: its size, and its successors. Encodings are those of the ARMv7-M Architecture
//! Reference Manual, A5 and A7.

/// The successors of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// The next instruction.
    Next,
    /// Always another address.
    Jump(u32),
    /// Another address, or the next instruction.
    Branch(u32),
    /// A function, and then the next instruction.
    Call(u32),
    /// The caller.
    Return,
    /// One of the addresses in the jump table that follows, whose entries have this many bytes.
    Table(u32),
    /// A fault.
    Trap,
    /// An address in a register or in memory, which cannot be followed.
    Indirect,
    /// The next instruction; this many instructions after it are conditional.
    Conditions(u32),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    pub bytes: u32,
    pub flow: Flow,
}

pub fn decode(at: u32, first: u32, second: u32) -> Instruction {
    if first >> 11 >= 0b11101 {
        Instruction { bytes: 4, flow: wide(at, first, second) }
    } else {
        Instruction { bytes: 2, flow: narrow(at, first) }
    }
}

fn narrow(at: u32, first: u32) -> Flow {
    let after = at.wrapping_add(4);
    match first {
        // B (T2), under a condition (T1), UDF.
        _ if first >> 11 == 0b11100 => Flow::Jump(after.wrapping_add(signed(first << 1, 12))),
        _ if first >> 8 == 0xDE => Flow::Trap,
        // SVC: an exception, which this program does not use.
        _ if first >> 8 == 0xDF => Flow::Indirect,
        _ if first >> 12 == 0b1101 => {
            Flow::Branch(after.wrapping_add(signed((first & 0xFF) << 1, 9)))
        }
        // CBZ, CBNZ.
        _ if first & 0xF500 == 0xB100 => {
            Flow::Branch(after.wrapping_add((first >> 9 & 1) << 6 | (first >> 3 & 31) << 1))
        }
        // IT.
        _ if first >> 8 == 0xBF && first & 15 != 0 => {
            Flow::Conditions(4 - (first & 15).trailing_zeros())
        }
        // BX to the caller, POP with pc.
        0x4770 => Flow::Return,
        _ if first >> 8 == 0xBD => Flow::Return,
        // BX, BLX, MOV pc, ADD pc.
        _ if first & 0xFF00 == 0x4700 => Flow::Indirect,
        _ if first & 0xFF87 == 0x4687 || first & 0xFF87 == 0x4487 => Flow::Indirect,
        _ => Flow::Next,
    }
}

fn wide(at: u32, first: u32, second: u32) -> Flow {
    match (first >> 11, second >> 14, second >> 12 & 1) {
        _ if first & 0xFFF0 == 0xF7F0 && second >> 12 == 0b1010 => return Flow::Trap,
        // BL, B.W (T4), B.W under a condition (T3).
        (0b11110, 0b11, 1) => return Flow::Call(far(at, first, second)),
        (0b11110, 0b10, 1) => return Flow::Jump(far(at, first, second)),
        (0b11110, 0b10, 0) if first >> 7 & 7 != 7 => return Flow::Branch(near(at, first, second)),
        _ => {}
    }
    let is_stack = first & 15 == 13;
    // TBB, TBH.
    if first & 0xFFF0 == 0xE8D0 && second & 0xFFE0 == 0xF000 {
        return if first & 15 == 15 { Flow::Table(1 + (second >> 4 & 1)) } else { Flow::Indirect };
    }
    // LDM with pc, LDR pc: from the stack they are returns.
    let is_load = first & 0xFFD0 == 0xE890 || first & 0xFFD0 == 0xE910;
    if is_load && second >> 15 == 1 || first & 0xFF70 == 0xF850 && second >> 12 == 15 {
        return if is_stack { Flow::Return } else { Flow::Indirect };
    }
    Flow::Next
}

/// Whether an instruction may write this register, one of the lower eight: true if any register field of its encoding
/// has that number. This includes some instructions that only read it.
pub fn may_write(register: u32, first: u32, second: u32) -> bool {
    let is_field = |half: u32, from: u32| half >> from & 15 == register;
    if first >> 11 < 0b11101 {
        let is_list = matches!(first >> 8, 0xBC | 0xBD) || first >> 12 == 0b1100;
        // Immediates, and addresses relative to pc or sp, have an 8-bit number in place of registers.
        let has_number = matches!(first >> 11, 0b00100..=0b00111 | 0b01001 | 0b10010..=0b10101);
        return first & 7 == register && !has_number
            || first >> 8 & 7 == register
            || is_list && first >> register & 1 == 1;
    }
    // Arithmetic, loads and stores of floats write no such register except the base that a load or store updates.
    let is_float = first >> 8 == 0xEE && second & 16 == 0
        || first >> 9 == 0b111_0110 && first & 0xFFE0 != 0xEC40;
    if is_float && second >> 9 & 7 == 0b101 {
        return first >> 8 != 0xEE && first & 0x20 != 0 && is_field(first, 0);
    }
    // A load or store with an offset of 12 bits.
    if first & 0xFE80 == 0xF880 {
        return is_field(second, 12);
    }
    // Arithmetic with a number, of which parts are in place of registers; MUL, MLA and MLS.
    if first >> 11 == 0b11110 && second >> 15 == 0 || first >> 4 == 0xFB0 {
        return is_field(second, 8);
    }
    let is_list = first & 0xFE40 == 0xE800;
    [(first, 0), (second, 0), (second, 8), (second, 12)]
        .into_iter()
        .any(|(half, from)| is_field(half, from))
        || is_list && second >> register & 1 == 1
}

/// Target of BL and B.W (T4).
pub fn far(at: u32, first: u32, second: u32) -> u32 {
    let sign = first >> 10 & 1;
    let one = !(second >> 13 ^ sign) & 1;
    let two = !(second >> 11 ^ sign) & 1;
    let offset = sign << 24 | one << 23 | two << 22 | (first & 0x3FF) << 12 | (second & 0x7FF) << 1;
    at.wrapping_add(4).wrapping_add(signed(offset, 25))
}

/// Target of B.W under a condition (T3).
pub fn near(at: u32, first: u32, second: u32) -> u32 {
    let (sign, one, two) = (first >> 10 & 1, second >> 13 & 1, second >> 11 & 1);
    let offset = sign << 20 | two << 19 | one << 18 | (first & 0x3F) << 12 | (second & 0x7FF) << 1;
    at.wrapping_add(4).wrapping_add(signed(offset, 21))
}

/// The lower `bits` bits as a two's complement number.
pub fn signed(value: u32, bits: u32) -> u32 {
    let shift = 32 - bits;
    ((value << shift).cast_signed() >> shift).cast_unsigned()
}

/// The number in MOVW or MOVT.
pub fn half_word(first: u32, second: u32) -> u32 {
    (first & 15) << 12 | (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xFF
}

/// Target of a long branch that the linker inserted, from flash to the TCM: MOVW ip, MOVT ip, BX ip.
pub fn long_branch(halves: [u32; 5]) -> Option<u32> {
    let [first, second, third, fourth, last] = halves;
    let loads_ip = first & 0xFBF0 == 0xF240
        && third & 0xFBF0 == 0xF2C0
        && second >> 8 & 15 == 12
        && fourth >> 8 & 15 == 12;
    let target = half_word(third, fourth) << 16 | half_word(first, second);
    (loads_ip && last == 0x4760).then_some(target & !1)
}
