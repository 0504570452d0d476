//! The calls and the stack of each function of an image for the microcontroller: read from its ELF.
//!
//! Only what that takes is decoded of the Thumb-2 instructions (ARM DDI 0403E, chapter A5): where an instruction ends,
//! calls and jumps to other functions, and what lowers the stack pointer. The linker's mapping symbols tell code from
//! the constants between it (ELF for the Arm Architecture, 5.5.5).

use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use std::collections::{BTreeMap, BTreeSet};

/// A function of an image.
#[derive(Clone, Debug, Default)]
pub struct Function {
    /// Its name, demangled as far as it goes without its hashes.
    pub name: String,
    /// Addresses of the functions that it calls or jumps to.
    pub calls: BTreeSet<u32>,
    /// Calls through a pointer.
    pub indirect_calls: usize,
    /// Most bytes of stack that it takes itself: everything that its instructions push, as if it were never popped.
    pub stack: u32,
    /// Its instructions that set a stack pointer that can't be read off, or that stop at a debugger.
    pub odd: Vec<String>,
}

/// The functions of an image by their addresses.
#[derive(Clone, Debug)]
pub struct Image {
    /// Address, without the Thumb bit, to function.
    pub functions: BTreeMap<u32, Function>,
}

impl Image {
    /// Reads an ELF.
    pub fn read(elf: &[u8]) -> Self {
        let file = object::File::parse(elf).expect("an ELF");
        let text = file.section_by_name(".text").expect("a section of code");
        let (base, code) = (text.address() as u32, text.data().expect("code"));
        let mut functions = BTreeMap::new();
        let mut ends = BTreeMap::new();
        // Where code and constants begin.
        let mut kinds = BTreeMap::new();
        for symbol in file.symbols().filter(|symbol| symbol.section_index() == Some(text.index())) {
            let (name, address) = (symbol.name().unwrap_or(""), symbol.address() as u32);
            if name == "$t" || name.starts_with("$t.") {
                kinds.insert(address, true);
            } else if name == "$d" || name.starts_with("$d.") {
                kinds.insert(address, false);
            } else if symbol.kind() == SymbolKind::Text && symbol.size() > 0 {
                let start = address & !1;
                let function: &mut Function = functions.entry(start).or_default();
                // One function may have several names.
                function.name = format!("{} {}", function.name, readable(name)).trim().to_owned();
                ends.insert(start, start + symbol.size() as u32);
            }
        }
        assert!(!functions.is_empty(), "the image has no symbols");
        for (&start, function) in &mut functions {
            let mut at = start;
            while at < ends[&start] {
                let is_code = kinds.range(..=at).next_back().is_none_or(|(_, &is_code)| is_code);
                if !is_code {
                    at += 2;
                    continue;
                }
                let half = |at: u32| {
                    let offset = (at - base) as usize;
                    u16::from_le_bytes([code[offset], code[offset + 1]])
                };
                let first = half(at);
                // 0b11101, 0b11110 and 0b11111 begin an instruction of two halfwords.
                let wide = first >> 11 >= 0b11101;
                let second = if wide { half(at + 2) } else { 0 };
                function.take(start..ends[&start], at, first, wide.then_some(second));
                at += if wide { 4 } else { 2 };
            }
        }
        Self { functions }
    }

    /// Address of the function with a name.
    pub fn address(&self, name: &str) -> u32 {
        let found: Vec<u32> = (self.functions.iter())
            .filter(|(_, function)| function.name.split(' ').any(|n| n == name))
            .map(|(&address, _)| address)
            .collect();
        assert_eq!(found.len(), 1, "functions of the name {name}");
        found[0]
    }

    /// Everything that is reached from some functions, with the way there.
    pub fn reached(&self, from: &[u32]) -> BTreeMap<u32, Vec<String>> {
        let mut reached = BTreeMap::new();
        let mut open: Vec<(u32, Vec<String>)> = from.iter().map(|&address| (address, Vec::new())).collect();
        while let Some((address, mut way)) = open.pop() {
            let Some(function) = self.functions.get(&address) else {
                panic!("{way:?} calls {address:#x}, which is no function");
            };
            if reached.contains_key(&address) {
                continue;
            }
            way.push(function.name.clone());
            open.extend(function.calls.iter().map(|&call| (call, way.clone())));
            reached.insert(address, way);
        }
        reached
    }

    /// Most bytes of stack below a function, with its own, and the way there.
    pub fn deepest(&self, from: u32) -> (u32, Vec<String>) {
        self.deepest_below(from, &mut Vec::new(), &mut BTreeMap::new())
    }

    fn deepest_below(
        &self,
        from: u32,
        above: &mut Vec<u32>,
        known: &mut BTreeMap<u32, (u32, Vec<String>)>,
    ) -> (u32, Vec<String>) {
        if let Some(deepest) = known.get(&from) {
            return deepest.clone();
        }
        let function = &self.functions[&from];
        assert!(!above.contains(&from), "{} calls itself", function.name);
        above.push(from);
        let below = (function.calls.iter())
            .map(|&call| self.deepest_below(call, above, known))
            .max_by_key(|(stack, _)| *stack)
            .unwrap_or_default();
        above.pop();
        let mut way = vec![format!("{} ({})", function.name, function.stack)];
        way.extend(below.1);
        let deepest = (function.stack + below.0, way);
        known.insert(from, deepest.clone());
        deepest
    }
}

impl Function {
    /// Looks at an instruction at an address; `second` is its second half, if it has one.
    fn take(&mut self, body: std::ops::Range<u32>, at: u32, first: u16, second: Option<u16>) {
        let Some(second) = second else {
            match first {
                // PUSH: the low registers and LR.
                _ if first & 0xfe00 == 0xb400 => self.stack += 4 * (first & 0x1ff).count_ones(),
                // SUB SP, SP, #imm7 * 4.
                _ if first & 0xff80 == 0xb080 => self.stack += 4 * u32::from(first & 0x7f),
                // BLX: a call through a pointer. BX is a return, or a jump through a pointer, unless of LR.
                _ if first & 0xff80 == 0x4780 => self.indirect_calls += 1,
                _ if first & 0xff80 == 0x4700 && first != 0x4770 => self.indirect_calls += 1,
                // BKPT.
                _ if first & 0xff00 == 0xbe00 => self.odd.push(format!("bkpt {:#04x}", first & 0xff)),
                // B, conditional and not: within eleven bits, which may be another function.
                _ if first & 0xf800 == 0xe000 => {
                    self.jump(&body, at, sign_extended(u32::from(first & 0x7ff) << 1, 12));
                }
                // MOV SP, register.
                _ if first & 0xff87 == 0x4685 => self.odd.push("mov sp".to_owned()),
                _ => {}
            }
            return;
        };
        let (first, second) = (u32::from(first), u32::from(second));
        match (first, second) {
            // PUSH.W = STMDB SP!.
            (0xe92d, _) => self.stack += 4 * (second & 0x5fff).count_ones(),
            // PUSH.W of one register = STR, [SP, #-4]!; other pre-decrements count as they do.
            (0xf84d, _) if second & 0x0f00 == 0x0d00 => self.stack += second & 0xff,
            // STRD, [SP, #-imm8 * 4]!.
            (0xe96d, _) => self.stack += 4 * (second & 0xff),
            // VPUSH: single and double registers; imm8 counts words.
            _ if first & 0xffbf == 0xed2d && second & 0x0e00 == 0x0a00 => self.stack += 4 * (second & 0xff),
            // SUB.W SP, SP, #modified constant; SUBW SP, SP, #imm12.
            (0xf1ad | 0xf5ad, _) if second & 0x8f00 == 0x0d00 => {
                self.stack += expanded(first >> 10 & 1, second);
            }
            (0xf2ad | 0xf6ad, _) if second & 0x8f00 == 0x0d00 => {
                self.stack += (first >> 10 & 1) << 11 | second >> 4 & 0x700 | second & 0xff;
            }
            // SUB.W SP, SP, register.
            (0xebad, _) if second & 0x0f00 == 0x0d00 => self.odd.push("sub sp, register".to_owned()),
            // BL, and B.W of 24 bits.
            _ if first & 0xf800 == 0xf000 && second & 0xd000 == 0xd000 => {
                self.calls.insert(branch(at, first, second));
            }
            _ if first & 0xf800 == 0xf000 && second & 0xd000 == 0x9000 => {
                let offset = branch(at, first, second).wrapping_sub(at + 4);
                self.jump(&body, at, offset);
            }
            // B.W, conditional, of 20 bits.
            _ if first & 0xf800 == 0xf000 && second & 0xd000 == 0x8000 && first & 0x0380 != 0x0380 => {
                let (s, j1, j2) = (first >> 10 & 1, second >> 13 & 1, second >> 11 & 1);
                let bits = s << 20 | j2 << 19 | j1 << 18 | (first & 0x3f) << 12 | (second & 0x7ff) << 1;
                self.jump(&body, at, sign_extended(bits, 21));
            }
            _ => {}
        }
    }

    /// A jump: within the function it is none of our business, beyond it is a call from its last line.
    fn jump(&mut self, body: &std::ops::Range<u32>, at: u32, offset: u32) {
        let target = at.wrapping_add(4).wrapping_add(offset);
        if !body.contains(&target) {
            self.calls.insert(target);
        }
    }
}

/// Target of a branch of 24 bits (A7.7.12, encoding T4; A7.7.18, T1).
fn branch(at: u32, first: u32, second: u32) -> u32 {
    let s = first >> 10 & 1;
    let i1 = !(second >> 13 ^ s) & 1;
    let i2 = !(second >> 11 ^ s) & 1;
    let bits = s << 24 | i1 << 23 | i2 << 22 | (first & 0x3ff) << 12 | (second & 0x7ff) << 1;
    at.wrapping_add(4).wrapping_add(sign_extended(bits, 25))
}

fn sign_extended(value: u32, bits: u32) -> u32 {
    let shift = 32 - bits;
    ((value << shift) as i32 >> shift) as u32
}

/// A modified immediate constant (A5.3.2).
fn expanded(i: u32, second: u32) -> u32 {
    let imm12 = i << 11 | second >> 4 & 0x700 | second & 0xff;
    let byte = imm12 & 0xff;
    match imm12 >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte * 0x0101_0101,
        _ => (0x80 | imm12 & 0x7f).rotate_right(imm12 >> 7),
    }
}

/// A mangled name as `path::to::item`, without generic arguments and hashes.
fn readable(name: &str) -> String {
    let plain = format!("{:#}", rustc_demangle::demangle(name));
    plain.replace(' ', "")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An instruction of one or two halfwords.
    type Instruction = (u16, Option<u16>);

    /// Instructions as `llvm-mc -triple=thumbv7em -show-encoding` writes them.
    fn function(instructions: &[Instruction]) -> Function {
        let mut function = Function::default();
        let mut at = 0x0800_0100;
        for &(first, second) in instructions {
            function.take(0x0800_0100..0x0800_0200, at, first, second);
            at += if second.is_some() { 4 } else { 2 };
        }
        function
    }

    #[test]
    fn stack_is_what_is_pushed() {
        let cases: [(&str, &[Instruction], u32); 9] = [
            ("push {r4, r5, r7, lr}", &[(0xb5b0, None)], 16),
            ("sub sp, #24", &[(0xb086, None)], 24),
            ("push.w {r8, r9, r10, r11}", &[(0xe92d, Some(0x0f00))], 16),
            ("str r11, [sp, #-4]!", &[(0xf84d, Some(0xbd04))], 4),
            ("vpush {d8, d9}", &[(0xed2d, Some(0x8b04))], 16),
            ("vpush {s16}", &[(0xed2d, Some(0x8a01))], 4),
            ("sub.w sp, sp, #1024", &[(0xf5ad, Some(0x6d80))], 1024),
            ("subw sp, sp, #2052", &[(0xf6ad, Some(0x0d04))], 2052),
            ("mov r0, r1; pop {r4, pc}", &[(0x4608, None), (0xbd10, None)], 0),
        ];
        for (text, instructions, stack) in cases {
            assert_eq!(function(instructions).stack, stack, "{text}");
        }
    }

    #[test]
    fn calls_and_jumps_out_are_found() {
        // bl 0x8000300 from 0x8000100; b.w back to 0x8000000; b to itself; blx r3.
        let calls =
            function(&[(0xf000, Some(0xf8fe)), (0xf7ff, Some(0xbf7c)), (0xe7fe, None), (0x4798, None)]);
        assert_eq!(calls.calls.iter().copied().collect::<Vec<_>>(), [0x0800_0000, 0x0800_0300]);
        assert_eq!(calls.indirect_calls, 1);
        assert_eq!(function(&[(0x4770, None)]).indirect_calls, 0, "bx lr");
        assert_eq!(function(&[(0xbeab, None)]).odd, ["bkpt 0xab"]);
    }
}
