//! Terms: symbolic words of 32 bits, and the knowledge that a path has gained about them.
//!
//! Two terms are equal if they apply the same operations to the same operands. Float operations `+ * /` are
//! uninterpreted. Only identities that hold for every bit pattern under rounding to nearest are used:
//! `a - b = a + (-b)`, `a + b = b + a`, `a b = b a`, `a + (-0) = a`, `1 a = a`, `2 a = a + a`, signs of products and
//! quotients, `-(-a) = a`, `|-a| = |a|`. Where a specification or a compiler has no absolute value, `|a|` is `-a` if
//! `a < 0`, else `a + 0`. The sign and payload of a NaN are irrelevant. Counts are sums modulo 2^32 in a normal form. A
//! count as a number is neither a NaN nor -0.
//!
//! Comparisons are decided: a comparison that does not follow from earlier ones splits the path in two.

use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasherDefault, Hash, Hasher};

/// Hasher for keys of a few small numbers, optimised for many lookups.
#[derive(Default)]
pub(super) struct Mixed(u64);

impl Hasher for Mixed {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 32
    }
    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.write_u64(u64::from(*byte));
        }
    }
    fn write_u8(&mut self, value: u8) {
        self.write_u64(value.into());
    }
    fn write_u32(&mut self, value: u32) {
        self.write_u64(value.into());
    }
    fn write_i32(&mut self, value: i32) {
        self.write_u64(u64::from(value as u32));
    }
    fn write_u64(&mut self, value: u64) {
        self.0 = (self.0.rotate_left(5) ^ value).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
    fn write_usize(&mut self, value: usize) {
        self.write_u64(value as u64);
    }
}

/// Hash table with such keys.
pub(super) type Mixing<K, V> = HashMap<K, V, BuildHasherDefault<Mixed>>;

/// Index of a term.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Term(u32);

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Node {
    Constant(u32),
    /// Input, by its index.
    Input(usize),
    /// Unknown content of a register at the entry.
    Entry(u32),
    Add(Term, Term),
    Mul(Term, Term),
    Div(Term, Term),
    Neg(Term),
    Abs(Term),
    /// Signed count converted to float.
    FromCount(Term),
    /// Sum of multiples and a constant, modulo 2^32.
    Sum(Vec<(Term, u32)>, u32),
    /// Arithmetic shift right.
    ShiftedRight(Term, u32),
    /// Other bit operation, by its name.
    Bits(&'static str, Term, Term),
}

pub(super) const MINUS_ZERO: u32 = 1 << 31;
const ONE: u32 = 0x3f80_0000;
const TWO: u32 = 0x4000_0000;

/// Relation of one number to another, as a set of these four. UNORDERED: one of them is a NaN.
pub(super) const LESS: u8 = 1;
pub(super) const EQUAL: u8 = 2;
pub(super) const GREATER: u8 = 4;
pub(super) const UNORDERED: u8 = 8;
/// Depth of nested sums that are searched.
const SEEN: usize = 4;
const ALL: [u8; 4] = [LESS, EQUAL, GREATER, UNORDERED];
const ANY: u8 = LESS | EQUAL | GREATER | UNORDERED;
const LESS_EQUAL: u8 = LESS | EQUAL;
const GREATER_EQUAL: u8 = GREATER | EQUAL;

/// All terms, each stored once.
#[derive(Default)]
pub(super) struct Terms {
    nodes: Vec<Node>,
    known: Mixing<Node, Term>,
}

impl Terms {
    fn term(&mut self, node: Node) -> Term {
        if let Some(term) = self.known.get(&node) {
            return *term;
        }
        let term = Term(self.nodes.len() as u32);
        self.nodes.push(node.clone());
        self.known.insert(node, term);
        term
    }

    fn node(&self, term: Term) -> &Node {
        &self.nodes[term.0 as usize]
    }

    pub(super) fn constant(&mut self, bits: u32) -> Term {
        self.term(Node::Constant(bits))
    }

    pub(super) fn bits(&self, term: Term) -> Option<u32> {
        match self.node(term) {
            Node::Constant(bits) => Some(*bits),
            _ => None,
        }
    }

    pub(super) fn input(&mut self, at: usize) -> Term {
        self.term(Node::Input(at))
    }

    pub(super) fn entry(&mut self, register: u32) -> Term {
        self.term(Node::Entry(register))
    }

    fn float(&self, term: Term) -> Option<f32> {
        self.bits(term).map(f32::from_bits)
    }

    pub(super) fn neg(&mut self, a: Term) -> Term {
        match *self.node(a) {
            Node::Constant(bits) => self.constant(bits ^ MINUS_ZERO),
            Node::Neg(inner) => inner,
            _ => self.term(Node::Neg(a)),
        }
    }

    pub(super) fn add(&mut self, a: Term, b: Term) -> Term {
        match (self.bits(a), self.bits(b)) {
            (Some(MINUS_ZERO), _) => b,
            (_, Some(MINUS_ZERO)) => a,
            (Some(a), Some(b)) => self.constant((f32::from_bits(a) + f32::from_bits(b)).to_bits()),
            (Some(0), _) if self.is_never_minus_zero(b, SEEN) => b,
            (_, Some(0)) if self.is_never_minus_zero(a, SEEN) => a,
            _ => self.term(Node::Add(a.min(b), a.max(b))),
        }
    }

    /// Returns whether the term is a count as a number, or its product with a finite number: never a NaN.
    fn is_of_count(&self, a: Term) -> bool {
        match *self.node(a) {
            Node::FromCount(_) => true,
            Node::Mul(one, other) => [(one, other), (other, one)].into_iter().any(|(factor, count)| {
                self.float(factor).is_some_and(f32::is_finite) && matches!(self.node(count), Node::FromCount(_))
            }),
            _ => false,
        }
    }

    /// Returns whether the term is -0 for no input, searching `deep` nested sums. A count is +0 or at least 1 in
    /// magnitude, and its product with a positive number is never -0. A sum is -0 only if both operands are.
    fn is_never_minus_zero(&self, a: Term, deep: usize) -> bool {
        match *self.node(a) {
            Node::Constant(bits) => bits != MINUS_ZERO,
            Node::FromCount(_) | Node::Abs(_) => true,
            Node::Mul(one, other) => {
                let above = |factor: Term| self.float(factor).is_some_and(|factor| factor > 0.0);
                self.is_of_count(a) && (above(one) || above(other))
            }
            Node::Add(one, other) if deep > 0 => {
                self.is_never_minus_zero(one, deep - 1) || self.is_never_minus_zero(other, deep - 1)
            }
            _ => false,
        }
    }

    #[cfg(test)]
    pub(super) fn sub(&mut self, a: Term, b: Term) -> Term {
        let b = self.neg(b);
        self.add(a, b)
    }

    /// Returns a term without its sign, and whether it had one.
    fn unsigned(&mut self, a: Term) -> (Term, bool) {
        match *self.node(a) {
            Node::Constant(bits) if bits & MINUS_ZERO != 0 => (self.constant(bits ^ MINUS_ZERO), true),
            Node::Neg(inner) => (inner, true),
            _ => (a, false),
        }
    }

    fn signed(&mut self, a: Term, negative: bool) -> Term {
        if negative { self.neg(a) } else { a }
    }

    pub(super) fn mul(&mut self, a: Term, b: Term) -> Term {
        let ((a, of_a), (b, of_b)) = (self.unsigned(a), self.unsigned(b));
        let product = match (self.bits(a), self.bits(b)) {
            (Some(ONE), _) => b,
            (_, Some(ONE)) => a,
            (Some(a), Some(b)) => self.constant((f32::from_bits(a) * f32::from_bits(b)).to_bits()),
            (Some(TWO), _) => self.add(b, b),
            (_, Some(TWO)) => self.add(a, a),
            _ => self.term(Node::Mul(a.min(b), a.max(b))),
        };
        self.signed(product, of_a != of_b)
    }

    pub(super) fn div(&mut self, a: Term, b: Term) -> Term {
        let ((a, of_a), (b, of_b)) = (self.unsigned(a), self.unsigned(b));
        let quotient = match (self.float(a), self.float(b)) {
            (_, Some(1.0)) => a,
            (Some(a), Some(b)) => self.constant((a / b).to_bits()),
            _ => self.term(Node::Div(a, b)),
        };
        self.signed(quotient, of_a != of_b)
    }

    /// Converts a signed count to float.
    pub(super) fn number_of(&mut self, a: Term) -> Term {
        match self.bits(a) {
            Some(bits) => self.constant((bits as i32 as f32).to_bits()),
            None => self.term(Node::FromCount(a)),
        }
    }

    /// Returns `a + factor b`, modulo 2^32.
    pub(super) fn plus(&mut self, a: Term, b: Term, factor: u32) -> Term {
        let (mut open, mut parts, mut constant) = (vec![(a, 1), (b, factor)], Vec::new(), 0_u32);
        while !open.is_empty() {
            while let Some((term, times)) = open.pop() {
                match self.node(term) {
                    Node::Constant(bits) => constant = constant.wrapping_add(bits.wrapping_mul(times)),
                    Node::Sum(inner, more) => {
                        constant = constant.wrapping_add(more.wrapping_mul(times));
                        open.extend(inner.iter().map(|(term, inner)| (*term, inner.wrapping_mul(times))));
                    }
                    _ => parts.push((term, times)),
                }
            }
            parts.sort_unstable();
            parts.dedup_by(|next, before| {
                let same = next.0 == before.0;
                before.1 = before.1.wrapping_add(if same { next.1 } else { 0 });
                same
            });
            parts.retain(|(_, times)| *times != 0);
            let other = parts.iter().position(|&(term, times)| self.multiple(term, times).is_some());
            if let Some((term, times)) = other.map(|at| parts.swap_remove(at)) {
                open.extend(self.multiple(term, times).into_iter().flat_map(|(a, times, less)| match less {
                    Some(bits) => {
                        let low = self.low_mask_of(bits);
                        vec![(a, times), (self.bitwise("and", a, low), times.wrapping_neg())]
                    }
                    None => vec![(a, times)],
                }));
            }
        }
        match (&parts[..], constant) {
            ([], _) => self.constant(constant),
            ([(term, 1)], 0) => *term,
            _ => self.term(Node::Sum(parts, constant)),
        }
    }

    /// Rewrites a multiple of masked or shifted bits as a multiple of the count itself: `2^k (a >> k)` is a minus its k
    /// low bits, and bits shifted out by the factor do not count. Returns the count, its factor, and the number of low
    /// bits to subtract.
    fn multiple(&self, term: Term, times: u32) -> Option<(Term, u32, Option<u32>)> {
        match *self.node(term) {
            Node::Bits("lsr", a, by) => {
                let by = self.bits(by).filter(|by| (1..32).contains(by) && *by <= times.trailing_zeros())?;
                Some((a, ((times as i32) >> by) as u32, Some(by)))
            }
            Node::Bits("and", a, mask) => {
                let low = self.low_bits_of_mask(mask)?;
                (low + times.trailing_zeros() >= 32).then_some((a, times, None))
            }
            _ => None,
        }
    }

    /// Returns the number of low bits of a mask that consists of low bits only.
    fn low_bits_of_mask(&self, mask: Term) -> Option<u32> {
        let mask = self.bits(mask)?;
        (mask != 0 && mask.wrapping_add(1).is_power_of_two()).then(|| mask.trailing_ones())
    }

    fn low_mask_of(&mut self, bits: u32) -> Term {
        self.constant((1 << bits) - 1)
    }

    /// Returns the range of a term made of low bits of a count (signed or unsigned), or of such bits and a constant.
    fn span(&self, a: Term) -> Option<(i64, i64)> {
        let (of, times, more) = match self.node(a) {
            Node::Sum(parts, more) => match parts[..] {
                [(of, times @ (1 | u32::MAX))] => (of, i64::from(times as i32), i64::from(*more as i32)),
                _ => return None,
            },
            _ => (a, 1, 0),
        };
        let (low, high) = match *self.node(of) {
            Node::Bits("and", _, mask) => (0, i64::from(self.bits(mask).filter(|mask| *mask < 1 << 31)?)),
            Node::ShiftedRight(_, by) if by > 0 => (-(1 << (31 - by)), (1 << (31 - by)) - 1),
            _ => return None,
        };
        let ends = [low, high].map(|end| more + times * end);
        Some((ends[0].min(ends[1]), ends[0].max(ends[1])))
    }

    /// Returns the signed number whose bits up to `sign` are the bits of `masked`.
    fn of_low_bits(&mut self, masked: Term, sign: u32) -> Option<Term> {
        let wanted = sign.wrapping_mul(2).wrapping_sub(1);
        let (masked, is_turned) = match self.node(masked) {
            Node::Sum(parts, more) => match parts[..] {
                [(of, u32::MAX)] if *more == wanted => (of, true),
                _ => return None,
            },
            _ => (masked, false),
        };
        let Node::Bits("and", a, mask) = *self.node(masked) else { return None };
        if !sign.is_power_of_two() || self.bits(mask) != Some(wanted) {
            return None;
        }
        // -1 - a is the bitwise complement of a.
        let all = self.constant(u32::MAX);
        let a = if is_turned { self.plus(all, a, u32::MAX) } else { a };
        Some(self.low_bits(a, sign.trailing_zeros() + 1))
    }

    /// Returns the lowest `bits` bits (1..=32), sign-extended.
    pub(super) fn low_bits(&mut self, a: Term, bits: u32) -> Term {
        // Bits above the width are irrelevant, also in the constant of a sum.
        let (half, above) = (1_i64 << (bits - 1), 32 - bits);
        let more = match self.node(a) {
            Node::Sum(_, more) => *more,
            _ => 0,
        };
        let reduced = self.constant((((more << above) as i32 >> above) as u32).wrapping_sub(more));
        let a = self.plus(a, reduced, 1);
        if self.span(a).is_some_and(|(low, high)| low >= -half && high < half) {
            return a;
        }
        let shifted = self.shifted_left(a, 32 - bits);
        self.shifted_right(shifted, 32 - bits)
    }

    pub(super) fn shifted_left(&mut self, a: Term, by: u32) -> Term {
        let zero = self.constant(0);
        self.plus(zero, a, 1_u32.checked_shl(by).unwrap_or(0))
    }

    pub(super) fn shifted_right(&mut self, a: Term, by: u32) -> Term {
        match (self.bits(a), by) {
            (_, 0) => a,
            (Some(bits), _) => self.constant(((bits as i32) >> by.min(31)) as u32),
            _ => self.term(Node::ShiftedRight(a, by.min(31))),
        }
    }

    /// Returns the product modulo 2^32.
    pub(super) fn times(&mut self, a: Term, b: Term) -> Term {
        let zero = self.constant(0);
        match (self.bits(a), self.bits(b)) {
            (Some(factor), _) => self.plus(zero, b, factor),
            (_, Some(factor)) => self.plus(zero, a, factor),
            _ => self.term(Node::Bits("mul", a.min(b), a.max(b))),
        }
    }

    /// Returns AND, ORR or EOR, or another operation that is only folded for constants.
    pub(super) fn bitwise(&mut self, name: &'static str, a: Term, b: Term) -> Term {
        let turns = ["and", "orr", "eor"].contains(&name) && self.bits(a).is_some();
        let (a, b) = if turns { (b, a) } else { (a, b) };
        match (name, self.bits(a), self.bits(b)) {
            ("and", Some(a), Some(b)) => self.constant(a & b),
            ("orr", Some(a), Some(b)) => self.constant(a | b),
            ("eor", Some(a), Some(b)) => self.constant(a ^ b),
            ("lsr", Some(a), Some(b)) => self.constant(a.checked_shr(b).unwrap_or(0)),
            ("quotient", Some(_), Some(0)) | ("and", _, Some(0)) => self.constant(0),
            ("quotient", Some(a), Some(b)) => self.constant((a as i32).wrapping_div(b as i32) as u32),
            ("and", _, Some(u32::MAX)) | ("orr" | "eor" | "lsr", _, Some(0)) => a,
            ("and", None, Some(mask)) if self.masked(a).is_some() => {
                let (a, other) = self.masked(a).unwrap_or((a, u32::MAX));
                let both = self.constant(mask & other);
                self.bitwise("and", a, both)
            }
            // A byte of a word composed of bytes: the bytes above are irrelevant.
            ("and", None, Some(mask)) if self.without_above(a, mask).is_some() => {
                let a = self.without_above(a, mask).unwrap_or(a);
                self.bitwise("and", a, b)
            }
            // ((a & (2 s - 1)) ^ s) - s: the sign-extended low bits of a.
            ("eor", None, Some(sign)) if self.of_low_bits(a, sign).is_some() => {
                let low = self.of_low_bits(a, sign).unwrap_or(a);
                self.plus(low, b, 1)
            }
            // No common bit.
            ("eor" | "orr", _, Some(bit))
                if bit.is_power_of_two() && self.span(a).is_some_and(|(low, high)| low >= 0 && high < bit.into()) =>
            {
                self.plus(a, b, 1)
            }
            ("and", _, Some(mask)) if mask.wrapping_neg().is_power_of_two() => {
                let low = self.constant(!mask);
                let low = self.bitwise("and", a, low);
                self.plus(a, low, u32::MAX)
            }
            ("and", _, Some(mask)) if mask.wrapping_add(1).is_power_of_two() => self.low_bits_alone(a, mask, true),
            // The highest bit has no carry.
            ("eor", _, Some(MINUS_ZERO)) => self.plus(a, b, 1),
            _ => self.term(Node::Bits(name, a, b)),
        }
    }

    fn masked(&self, a: Term) -> Option<(Term, u32)> {
        match *self.node(a) {
            Node::Bits("and", a, mask) => Some((a, self.bits(mask)?)),
            _ => None,
        }
    }

    /// Removes the irrelevant parts of a sum that is shifted right and masked; `None` if every part has relevant bits.
    fn without_above(&mut self, a: Term, mask: u32) -> Option<Term> {
        let Node::Bits("lsr", sum, by) = *self.node(a) else { return None };
        let looked_at = self.bits(by)?.checked_add(32 - mask.leading_zeros()).filter(|bits| *bits < 32)?;
        let of_parts = |terms: &Self, sum: Term| match terms.node(sum) {
            Node::Constant(_) => 0,
            Node::Sum(parts, _) => parts.len(),
            _ => 1,
        };
        let low = self.low_mask_of(looked_at);
        let low = self.bitwise("and", sum, low);
        let left = self.masked(low).map_or(low, |(left, _)| left);
        (of_parts(self, left) < of_parts(self, sum)).then(|| self.bitwise("lsr", left, by))
    }

    /// Applies a mask of low bits: higher bits of the parts of a sum are irrelevant.
    fn low_bits_alone(&mut self, a: Term, mask: u32, may_turn: bool) -> Term {
        let above = mask.leading_zeros();
        let (mut sum, mut constant) = (Vec::new(), 0);
        match self.node(a) {
            Node::Sum(parts, more) => (sum, constant) = (parts.clone(), *more),
            _ => sum.push((a, 1)),
        }
        let mut reduced = self.constant(constant & mask);
        for (term, times) in sum {
            let inner = match *self.node(term) {
                Node::Bits("and", inner, other) if self.bits(other).is_some_and(|other| other & mask == mask) => inner,
                _ => term,
            };
            reduced = self.plus(reduced, inner, ((times << above) as i32 >> above) as u32);
        }
        let constant = match self.node(reduced) {
            Node::Sum(_, more) => *more,
            _ => 0,
        };
        let more = self.constant((constant & mask).wrapping_sub(constant));
        let reduced = self.plus(reduced, more, 1);
        let of_mask = self.constant(mask);
        let is_turned = match self.node(reduced) {
            Node::Constant(bits) => return self.constant(bits & mask),
            Node::Sum(parts, _) => may_turn && (parts[0].1 as i32) < 0,
            _ => false,
        };
        if is_turned {
            // -1 - a is the bitwise complement of a.
            let all = self.constant(u32::MAX);
            let others = self.plus(all, reduced, u32::MAX);
            let others = self.low_bits_alone(others, mask, false);
            return self.plus(of_mask, others, u32::MAX);
        }
        self.term(Node::Bits("and", reduced, of_mask))
    }

    /// Returns a text of the term for messages, a few levels deep.
    #[cfg(test)]
    pub(super) fn shown(&self, term: Term, names: &[String], depth: usize) -> String {
        let of = |term: &Term| self.shown(*term, names, depth - 1);
        if depth == 0 {
            return "..".into();
        }
        match self.node(term) {
            Node::Constant(bits) => match f32::from_bits(*bits) {
                number if *bits == 0 || number.is_normal() => format!("{number:?}"),
                _ => format!("{bits:#x}"),
            },
            Node::Input(at) => names[*at].clone(),
            Node::Entry(register) => format!("register {register} at the entry"),
            Node::Add(a, b) => match self.node(*b) {
                Node::Neg(b) => format!("({} - {})", of(a), of(b)),
                _ => format!("({} + {})", of(a), of(b)),
            },
            Node::Mul(a, b) => format!("{} {}", of(a), of(b)),
            Node::Div(a, b) => format!("{} / {}", of(a), of(b)),
            Node::Neg(a) => format!("-{}", of(a)),
            Node::Abs(a) => format!("|{}|", of(a)),
            Node::FromCount(a) => format!("float({})", of(a)),
            Node::Sum(parts, constant) => {
                let parts: Vec<String> =
                    parts.iter().map(|(term, times)| format!("{} {}", *times as i32, of(term))).collect();
                format!("({} + {})", parts.join(" + "), *constant as i32)
            }
            Node::ShiftedRight(a, by) => format!("({} >> {by})", of(a)),
            Node::Bits(name, a, b) => format!("{name}({}, {})", of(a), of(b)),
        }
    }
}

#[cfg(test)]
impl Terms {
    /// Returns the value of a term for these inputs.
    pub(super) fn value(&self, term: Term, inputs: &[u32]) -> u32 {
        let of = |term: &Term| self.value(*term, inputs);
        let float = |term: &Term| f32::from_bits(of(term));
        match self.node(term) {
            Node::Constant(bits) => *bits,
            Node::Input(at) => inputs[*at],
            Node::Entry(register) => panic!("register {register} is no input"),
            Node::Add(a, b) => (float(a) + float(b)).to_bits(),
            Node::Mul(a, b) => (float(a) * float(b)).to_bits(),
            Node::Div(a, b) => (float(a) / float(b)).to_bits(),
            Node::Neg(a) => of(a) ^ MINUS_ZERO,
            Node::Abs(a) => of(a) & !MINUS_ZERO,
            Node::FromCount(a) => (of(a) as i32 as f32).to_bits(),
            Node::Sum(parts, constant) => {
                parts.iter().fold(*constant, |sum, (term, times)| sum.wrapping_add(of(term).wrapping_mul(*times)))
            }
            Node::ShiftedRight(a, by) => (of(a) as i32 >> by) as u32,
            Node::Bits("and", a, b) => of(a) & of(b),
            Node::Bits("orr", a, b) => of(a) | of(b),
            Node::Bits("eor", a, b) => of(a) ^ of(b),
            Node::Bits("lsr", a, b) => of(a).checked_shr(of(b)).unwrap_or(0),
            Node::Bits("mul", a, b) => of(a).wrapping_mul(of(b)),
            Node::Bits(name, ..) => panic!("{name} has no value here"),
        }
    }
}

/// Returns the relation of the second number to the first.
pub(super) fn turned(set: u8) -> u8 {
    set & (EQUAL | UNORDERED) | (set & LESS) << 2 | (set & GREATER) >> 2
}

pub(super) fn between(a: f32, b: f32) -> u8 {
    match a.partial_cmp(&b) {
        Some(std::cmp::Ordering::Less) => LESS,
        Some(std::cmp::Ordering::Equal) => EQUAL,
        Some(std::cmp::Ordering::Greater) => GREATER,
        None => UNORDERED,
    }
}

/// Returns the possible relations of a to b, if a has the first relation to a number and that number the second to b.
fn through(first: u8, second: u8) -> u8 {
    let mut may = 0;
    for (one, other) in ALL.into_iter().flat_map(|one| ALL.map(|other| (one, other))) {
        if first & one != 0 && second & other != 0 {
            may |= match (one, other) {
                (UNORDERED, _) | (_, UNORDERED) => UNORDERED,
                (EQUAL, other) => other,
                (one, EQUAL) => one,
                (one, other) if one == other => one,
                _ => LESS | EQUAL | GREATER,
            };
        }
    }
    may
}

/// Returns the possible relations of x to `to`, if x has one of the relations in `set` to `known`.
pub(super) fn follows(set: u8, known: f32, to: f32) -> u8 {
    let order = between(known, to);
    let mut may = set & UNORDERED;
    if set & EQUAL != 0 {
        may |= order;
    }
    if set & LESS != 0 {
        may |= if order & (LESS | EQUAL) != 0 { LESS } else { LESS | EQUAL | GREATER };
    }
    if set & GREATER != 0 {
        may |= if order & (GREATER | EQUAL) != 0 { GREATER } else { LESS | EQUAL | GREATER };
    }
    may
}

/// Comparison of two counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Order {
    /// Equal bits.
    Equal,
    /// Less, signed.
    Less,
    /// Less, unsigned.
    Below,
}

/// Treatment of absolute values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Signs {
    /// As an operation without further rules: fast.
    Whole,
    /// By its sign where the sign is decided; in comparisons by both bounds: `|a| <= b` is `a >= -b` and `a <= b`.
    Known,
    /// By its sign, which is decided: splits each path in two.
    Asked,
}

/// One path: the outcomes still to use, and the knowledge from the decided comparisons.
pub(super) struct Path<'a> {
    pub(super) terms: &'a mut Terms,
    script: &'a [bool],
    given: Vec<bool>,
    /// Known relations, by the first number of a pair.
    relations: Mixing<Term, Vec<(Term, u8)>>,
    orders: Mixing<(Order, Term, Term), bool>,
    truths: Mixing<usize, bool>,
    /// Distance of one address behind another modulo 2^32: minimum and maximum.
    apart: Mixing<(Term, Term), (u32, u32)>,
    numbers: HashSet<Term>,
    nans: HashSet<Term>,
    signs: Signs,
}

impl<'a> Path<'a> {
    pub(super) fn new(terms: &'a mut Terms, script: &'a [bool], signs: Signs) -> Self {
        Self {
            terms,
            script,
            signs,
            given: Vec::new(),
            relations: Mixing::default(),
            orders: Mixing::default(),
            truths: Mixing::default(),
            apart: Mixing::default(),
            numbers: HashSet::new(),
            nans: HashSet::new(),
        }
    }

    /// Returns the outcomes of this path.
    pub(super) fn answers(&self) -> Vec<bool> {
        self.given.clone()
    }

    /// Returns the outcomes of the next path: the last "yes" becomes "no".
    pub(super) fn next(mut answers: Vec<bool>) -> Option<Vec<bool>> {
        while answers.pop_if(|answer| !*answer).is_some() {}
        *answers.last_mut()? = false;
        Some(answers)
    }

    fn ask(&mut self) -> bool {
        let answer = self.script.get(self.given.len()).copied().unwrap_or(true);
        self.given.push(answer);
        answer
    }

    /// Decides an input that is true or false.
    pub(super) fn truth(&mut self, input: usize) -> bool {
        if let Some(known) = self.truths.get(&input) {
            return *known;
        }
        let answer = self.ask();
        self.truths.insert(input, answer);
        answer
    }

    /// Returns the part of a number that a comparison uses: zeros have no sign.
    fn magnitude(&mut self, mut a: Term) -> (Term, bool) {
        let mut negative = false;
        loop {
            match *self.terms.node(a) {
                Node::Neg(inner) => (a, negative) = (inner, !negative),
                Node::Add(one, other) if self.terms.bits(one) == Some(0) => a = other,
                Node::Add(one, other) if self.terms.bits(other) == Some(0) => a = one,
                Node::Constant(bits) => {
                    let bits = if negative { bits ^ MINUS_ZERO } else { bits };
                    let bits = if bits == MINUS_ZERO { 0 } else { bits };
                    return (self.terms.constant(bits), false);
                }
                _ => return (a, negative),
            }
        }
    }

    /// Decides whether the first number has one of the relations in `set` to the second.
    pub(super) fn stands(&mut self, a: Term, set: u8, b: Term) -> bool {
        let (a, set, b, bare) = match self.compared(a, set, b) {
            Ok(answer) => return answer,
            Err(asked) => asked,
        };
        if let (&Node::FromCount(count), Some(0)) = (self.terms.node(a), self.terms.bits(b)) {
            // A count is 0 if its float is 0.
            let zero = self.terms.constant(0);
            if set & !UNORDERED == EQUAL {
                return self.ordered(Order::Equal, count, zero);
            }
            if set & !UNORDERED == LESS | GREATER {
                return !self.ordered(Order::Equal, count, zero);
            }
        }
        let may = self.may_stand(a, b, bare);
        if may & !set == 0 || may & set == 0 {
            return may & !set == 0;
        }
        let answer = self.ask();
        let may = may & if answer { set } else { !set };
        let known = self.relations.entry(a).or_default();
        known.retain(|(other, _)| *other != b);
        known.push((b, may));
        if may & UNORDERED == 0 {
            self.numbers.extend([a, bare]);
        } else if may == UNORDERED {
            if self.is_number(bare) {
                self.nans.insert(a);
            } else if self.is_number(a) {
                self.nans.insert(bare);
            }
        }
        answer
    }

    /// Returns the outcome, if it follows from earlier comparisons.
    fn follows_of(&mut self, a: Term, set: u8, b: Term) -> Option<bool> {
        let (a, set, b, bare) = match self.compared(a, set, b) {
            Ok(answer) => return Some(answer),
            Err(asked) => asked,
        };
        let may = self.may_stand(a, b, bare);
        (may & !set == 0 || may & set == 0).then_some(may & !set == 0)
    }

    /// Returns the normal form of a comparison, also with the second number without its sign, or the outcome for
    /// constants.
    fn compared(&mut self, a: Term, set: u8, b: Term) -> Result<bool, (Term, u8, Term, Term)> {
        let ((mut a, mut of_a), (mut b, mut of_b), mut set) = (self.magnitude(a), self.magnitude(b), set);
        if let (Some(a), Some(b)) = (self.terms.float(a), self.terms.float(b)) {
            return Ok(between(a, b) & set != 0);
        }
        if self.terms.bits(a).is_some() || (self.terms.bits(b).is_none() && a > b) {
            (a, of_a, b, of_b, set) = (b, of_b, a, of_a, turned(set));
        }
        if of_a {
            (of_b, set) = (!of_b, turned(set));
        }
        let bare = b;
        b = self.terms.signed(b, of_b);
        let b = if self.terms.bits(b) == Some(MINUS_ZERO) { self.terms.constant(0) } else { b };
        Err((a, set, b, bare))
    }

    fn is_number(&self, a: Term) -> bool {
        self.numbers.contains(&a) || self.terms.float(a).is_some_and(|number| !number.is_nan()) || {
            self.terms.is_of_count(a)
        }
    }

    /// Returns the possible relations of two numbers; `bare` is the second without its sign.
    fn may_stand(&self, a: Term, b: Term, bare: Term) -> u8 {
        if let Some(to) = self.terms.float(b) {
            return self.may_stand_to(a, to);
        }
        let mut may = if a == b { EQUAL | UNORDERED } else { ANY };
        if self.is_number(a) && self.is_number(bare) {
            may &= !UNORDERED;
        }
        if self.nans.contains(&a) || self.nans.contains(&bare) {
            may &= UNORDERED;
        }
        for (_, set) in self.known_of(a).filter(|(other, _)| *other == b) {
            may &= set;
        }
        // Through a constant between the two numbers.
        let of_b = |to: f32| {
            if bare == b { self.may_stand_to(bare, to) } else { turned(self.may_stand_to(bare, -to)) }
        };
        let constants = |of: Term| self.known_of(of).filter_map(|(other, _)| self.terms.float(other));
        for between in constants(a).chain(constants(bare)).filter(|between| !between.is_nan()) {
            may &= through(self.may_stand_to(a, between), turned(of_b(between)));
            may &= through(self.may_stand_to(a, -between), turned(of_b(-between)));
        }
        may
    }

    /// Returns the possible relations of a number to a constant.
    fn may_stand_to(&self, a: Term, to: f32) -> u8 {
        if to.is_nan() {
            return UNORDERED;
        }
        let mut may = if self.is_number(a) { ANY & !UNORDERED } else { ANY };
        if self.nans.contains(&a) {
            may &= UNORDERED;
        }
        for (other, set) in self.known_of(a) {
            if let Some(known) = self.terms.float(other).filter(|known| !known.is_nan()) {
                may &= follows(set, known, to);
            }
        }
        may
    }

    fn known_of(&self, a: Term) -> impl Iterator<Item = (Term, u8)> {
        self.relations.get(&a).into_iter().flatten().copied()
    }

    pub(super) fn abs(&mut self, a: Term) -> Term {
        let zero = self.terms.constant(0);
        let asked = match self.signs {
            Signs::Whole => false,
            Signs::Known => self.follows_of(a, LESS, zero).is_some(),
            Signs::Asked => true,
        };
        if asked {
            return if self.stands(a, LESS, zero) { self.terms.neg(a) } else { self.terms.add(a, zero) };
        }
        match self.terms.unsigned(a).0 {
            a if self.terms.bits(a).is_some() => a,
            a => self.terms.term(Node::Abs(a)),
        }
    }

    /// Decides whether |a| has one of the relations in `set` to b; `None` if the absolute value itself must be
    /// compared.
    pub(super) fn magnitude_stands(&mut self, a: Term, set: u8, b: Term) -> Option<bool> {
        if self.signs != Signs::Known {
            return None;
        }
        // Sets that contain UNORDERED are complements of the others.
        let (within, holds) = match set {
            LESS | LESS_EQUAL => (set, true),
            _ if set == ANY & !LESS || set == ANY & !LESS_EQUAL => (ANY & !set, false),
            GREATER | GREATER_EQUAL => {
                let beyond = self.terms.neg(b);
                return Some(self.stands(a, turned(set), beyond) || self.stands(a, set, b));
            }
            _ => return None,
        };
        let below = self.terms.neg(b);
        Some((self.stands(a, turned(within), below) && self.stands(a, within, b)) == holds)
    }

    /// Assumes that the memory at these addresses, with these sizes, does not overlap.
    pub(super) fn are_apart(&mut self, one: Term, size: u32, other: Term, of_other: u32) {
        self.apart.insert((one, other), (of_other, size.wrapping_neg()));
        self.apart.insert((other, one), (size, of_other.wrapping_neg()));
    }

    /// Returns the known range of a count.
    fn range(&self, a: Term) -> Option<(u32, u32)> {
        match self.terms.node(a) {
            Node::Constant(bits) => Some((*bits, *bits)),
            Node::Sum(parts, more) => {
                let ([(one, 1), (other, u32::MAX)] | [(other, u32::MAX), (one, 1)]) = parts[..] else { return None };
                let (low, high) = *self.apart.get(&(one, other))?;
                let (low, high) = (low.wrapping_add(*more), high.wrapping_add(*more));
                (low <= high).then_some((low, high))
            }
            _ => None,
        }
    }

    /// Returns a bit operation, using the knowledge about the first operand: a non-negative number that fits a mask
    /// keeps all bits under it, and loses all under its complement or a long shift.
    pub(super) fn bitwise(&mut self, name: &'static str, a: Term, b: Term) -> Term {
        if let (Some((inner, one)), Some(other), "and") = (self.terms.masked(a), self.terms.bits(b), name) {
            let both = self.terms.constant(one & other);
            return self.bitwise("and", inner, both);
        }
        if let (Some((low, high)), Some(with)) = (self.terms.span(a), self.terms.bits(b))
            && (low >= 0 || low > -(1 << 31) && high < 1 << 31 && self.is_not_negative(a))
        {
            let below = |bits: u32| high < 1_i64 << bits.min(32);
            match name {
                "and" if with.wrapping_add(1).is_power_of_two() && below(with.trailing_ones()) => return a,
                "and" if with.wrapping_neg().is_power_of_two() && below(with.trailing_zeros()) => {
                    return self.terms.constant(0);
                }
                "lsr" if below(with) => return self.terms.constant(0),
                "eor" | "orr" if with.is_power_of_two() && below(with.trailing_zeros()) => {
                    return self.terms.plus(a, b, 1);
                }
                _ => {}
            }
        }
        self.terms.bitwise(name, a, b)
    }

    /// Returns whether a count is known to be non-negative, if its range neither wraps nor contains the least number.
    fn is_not_negative(&mut self, a: Term) -> bool {
        let zero = self.terms.constant(0);
        let turned = self.terms.plus(zero, a, u32::MAX);
        self.orders.get(&(Order::Less, a, zero)) == Some(&false)
            || self.orders.get(&(Order::Less, turned, zero)) == Some(&true)
    }

    /// Returns the signed quotient of counts, rounded towards 0. For a power of two it is the upper bits of the count;
    /// a negative count is negated before, and its quotient after.
    pub(super) fn quotient(&mut self, a: Term, b: Term) -> Term {
        if let (Some((low, high)), Some(by)) = (self.terms.span(a), self.terms.bits(b))
            && (low.abs().max(high) < i64::from(by) && by < 1 << 31 && self.signs != Signs::Whole)
        {
            return self.terms.constant(0);
        }
        let by = self.terms.bits(b).filter(|of| of.is_power_of_two() && *of < 1 << 31 && self.signs != Signs::Whole);
        let Some(by) = by.map(u32::trailing_zeros) else { return self.terms.bitwise("quotient", a, b) };
        let (zero, by) = (self.terms.constant(0), self.terms.constant(by));
        if self.ordered(Order::Less, a, zero) {
            let turned = self.terms.plus(zero, a, u32::MAX);
            let quotient = self.terms.bitwise("lsr", turned, by);
            self.terms.plus(zero, quotient, u32::MAX)
        } else {
            self.terms.bitwise("lsr", a, by)
        }
    }

    /// Decides the order of two counts.
    pub(super) fn ordered(&mut self, order: Order, a: Term, b: Term) -> bool {
        let (a, b) = if order == Order::Equal {
            // Uses the difference, up to its sign.
            let (one, other) = (self.terms.plus(a, b, u32::MAX), self.terms.plus(b, a, u32::MAX));
            (one.min(other), self.terms.constant(0))
        } else {
            (a, b)
        };
        match (self.terms.bits(a), self.terms.bits(b)) {
            (Some(a), Some(b)) => {
                return match order {
                    Order::Equal => a == b,
                    Order::Less => (a as i32) < b as i32,
                    Order::Below => a < b,
                };
            }
            _ if a == b => return order == Order::Equal,
            _ => {}
        }
        if let (Some(a), Some(b), Order::Equal | Order::Below) = (self.range(a), self.range(b), order) {
            if a.1 < b.0 {
                return order == Order::Below;
            }
            if b.1 < a.0 || (order == Order::Below && b.1 == a.0) {
                return false;
            }
        }
        if let Some(known) = self.orders.get(&(order, a, b)) {
            return *known;
        }
        let answer = self.ask();
        self.orders.insert((order, a, b), answer);
        answer
    }

    /// Converts an unsigned count to float; `None` if its sign is unknown. For a negative a, -(float)(0 - a) is the
    /// float of a.
    pub(super) fn number_without_sign_of(&mut self, a: Term) -> Option<Term> {
        let zero = self.terms.constant(0);
        let turned = self.terms.plus(zero, a, u32::MAX);
        if self.ordered(Order::Less, turned, zero) {
            let number = self.terms.number_of(turned);
            Some(self.terms.neg(number))
        } else if !self.ordered(Order::Less, a, zero) {
            Some(self.terms.number_of(a))
        } else {
            None
        }
    }
}
