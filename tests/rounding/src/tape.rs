//! The recording scalar, and the walk over a kernel's paths.
//!
//! What a kernel makes of literals alone also has its value, so that a test can compare the order of its operations with
//! the processor's results.

use std::cell::RefCell;
use std::cmp::Ordering;
use std::ops::{Add, Mul, Sub};

use crate::term::Sum;

/// A number of a kernel: each operation on it is recorded, and rounds.
#[derive(Clone, Copy, Debug)]
pub struct Traced(usize);

/// A recorded number.
#[derive(Clone, Debug)]
struct Node {
    /// What the script calls it.
    name: String,
    sum: Sum,
    /// If it follows from literals. In binary64, that of binary32 operands rounds again to what binary32 rounds to at once.
    value: Option<f64>,
}

/// A square root whose argument is a sum of squares.
#[derive(Clone, Debug)]
pub struct Root {
    /// What the script calls the argument as computed.
    pub of: String,
    /// The argument as computed.
    pub sum: Sum,
}

/// A comparison, and how it turned out: `greater` is greater than the other, or as great.
#[derive(Clone, Copy, Debug)]
pub struct Branch {
    /// The number that turned out not to be less.
    pub greater: Traced,
    /// The number that turned out not to be greater.
    pub less: Traced,
}

/// What a run of a kernel has recorded.
#[derive(Clone, Debug, Default)]
pub struct Tape {
    nodes: Vec<Node>,
    /// The script's definitions.
    pub definitions: Vec<String>,
    /// Names of relative errors.
    pub deltas: Vec<String>,
    /// Names of absolute errors, of products that underflow.
    pub etas: Vec<String>,
    /// Bounds on an input: name, lowest, highest.
    pub inputs: Vec<(String, String, String)>,
    /// The roots, in order.
    pub roots: Vec<Root>,
    /// How comparisons turn out.
    script: Vec<bool>,
    /// The comparisons that were made.
    pub branches: Vec<Branch>,
}

thread_local! {
    static TAPE: RefCell<Tape> = RefCell::default();
}

/// Runs a kernel once for each of its paths: what it returned, and what was recorded.
///
/// A comparison with NaN is none of the paths: the goals are about finite numbers.
pub fn paths<T>(kernel: impl Fn() -> T) -> Vec<(T, Tape)> {
    let mut found = Vec::new();
    let mut script = Vec::new();
    loop {
        TAPE.set(Tape { script, ..Tape::default() });
        let result = kernel();
        let tape = TAPE.take();
        script = tape.script.clone();
        found.push((result, tape));
        while script.last() == Some(&false) {
            script.pop();
        }
        let Some(last) = script.last_mut() else { return found };
        *last = false;
    }
}

/// The comparisons so far.
pub fn branches() -> Vec<Branch> {
    TAPE.with_borrow(|tape| tape.branches.clone())
}

fn add(name: String, sum: Sum, value: Option<f64>) -> Traced {
    TAPE.with_borrow_mut(|tape| {
        tape.nodes.push(Node { name, sum, value });
        Traced(tape.nodes.len() - 1)
    })
}

fn define(name: &str, text: &str) {
    TAPE.with_borrow_mut(|tape| tape.definitions.push(format!("{name} = {text};")));
}

fn next() -> usize {
    TAPE.with_borrow(|tape| tape.nodes.len())
}

/// An input between two numbers, given as Gappa writes them.
pub fn input(name: &str, low: &str, high: &str) -> Traced {
    TAPE.with_borrow_mut(|tape| {
        tape.inputs.push((name.to_owned(), low.to_owned(), high.to_owned()));
    });
    add(name.to_owned(), Sum::input(name), None)
}

/// A coordinate or a difference of coordinates: of either sign.
pub fn coordinate(name: &str) -> Traced {
    input(name, "-1b31", "1b31")
}

/// A length that may be zero.
pub fn length(name: &str) -> Traced {
    input(name, "0", "1b33")
}

/// The exact number `1 + error`, for an error of at most `most` (as Gappa writes it).
pub fn near_one(error: &str, most: &str) -> Traced {
    TAPE.with_borrow_mut(|tape| {
        tape.inputs.push((error.to_owned(), format!("-{most}"), most.to_owned()));
    });
    let small = add(error.to_owned(), Sum::number(1.0).factor(error), None);
    Traced::exact(1.0).plus(small)
}

/// The exact value of the root of this number, counted from 1.
pub fn root(number: usize) -> Traced {
    let name = format!("root{number}");
    add(name.clone(), Sum::input(&name), None)
}

impl Traced {
    /// Not a number: never part of a path.
    pub const NAN: Self = Self(usize::MAX);

    fn node(self) -> Node {
        TAPE.with_borrow(|tape| tape.nodes[self.0].clone())
    }

    /// What the script calls it.
    #[must_use]
    pub fn name(self) -> String {
        self.node().name
    }

    pub(crate) fn sum(self) -> Sum {
        self.node().sum
    }

    /// What a kernel computes, if it follows from literals.
    #[cfg(test)]
    pub fn value(self) -> Option<f32> {
        self.node().value.map(|value| value as f32)
    }

    /// A literal of a kernel.
    #[must_use]
    pub fn literal(value: f32) -> Self {
        Self::exact(f64::from(value))
    }

    /// An integer that a kernel converts: all are below `2^24`.
    #[must_use]
    pub fn from_integer(integer: Self) -> Self {
        integer
    }

    /// A number as it is.
    #[must_use]
    pub fn exact(value: f64) -> Self {
        add(crate::term::number(value), Sum::number(value), Some(value))
    }

    fn rounded(exact: Node, has_underflow: bool) -> Self {
        let at = next();
        let (name, delta, eta) = (format!("v{at}"), format!("delta{at}"), format!("eta{at}"));
        let factor = format!("(1 + {delta})");
        let mut sum = exact.sum.factor(&factor);
        let mut text = format!("{} * {factor}", exact.name);
        if has_underflow {
            sum = sum.plus(&Sum::number(1.0).factor(&eta));
            text = format!("{text} + {eta}");
        }
        define(&name, &text);
        TAPE.with_borrow_mut(|tape| {
            tape.deltas.push(delta);
            tape.etas.extend(has_underflow.then_some(eta));
        });
        add(name, sum, exact.value.map(|value| f64::from(value as f32)))
    }

    /// The square root, correctly rounded, of a sum of squares.
    pub(crate) fn sqrt(self) -> Self {
        let Node { name, sum, value } = self.node();
        let at = TAPE.with_borrow_mut(|tape| {
            tape.roots.push(Root { of: name.clone(), sum: sum.clone() });
            tape.roots.len()
        });
        define(&format!("exact{at}"), &sum.exact().text());
        define(&format!("root{at}"), &format!("sqrt(exact{at})"));
        define(&format!("computed{at}"), &format!("sqrt({name})"));
        define(&format!("ratio{at}"), &format!("computed{at} / root{at}"));
        let root = Sum::input(&format!("root{at}")).factor(&format!("ratio{at}"));
        let name = format!("computed{at}");
        Self::rounded(Node { name, sum: root, value: value.map(f64::sqrt) }, true)
    }

    /// The exact sum.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        let (a, b) = (self.node(), other.node());
        let value = a.value.zip(b.value).map(|(a, b)| a + b);
        add(format!("({} + {})", a.name, b.name), a.sum.plus(&b.sum), value)
    }

    /// The exact difference.
    #[must_use]
    pub fn minus(self, other: Self) -> Self {
        let (a, b) = (self.node(), other.node());
        let sum = a.sum.plus(&b.sum.times(&Sum::number(-1.0)));
        let value = a.value.zip(b.value).map(|(a, b)| a - b);
        add(format!("({} - {})", a.name, b.name), sum, value)
    }

    /// The exact product.
    #[must_use]
    pub fn times(self, other: Self) -> Self {
        let (a, b) = (self.node(), other.node());
        let value = a.value.zip(b.value).map(|(a, b)| a * b);
        add(format!("({} * {})", a.name, b.name), a.sum.times(&b.sum), value)
    }

    /// Whether this is greater: a choice, unless both have a value.
    fn branch(self, other: Self, or_equal: bool) -> bool {
        if let Some((value, other)) = self.node().value.zip(other.node().value) {
            return if or_equal { value >= other } else { value > other };
        }
        TAPE.with_borrow_mut(|tape| {
            let at = tape.branches.len();
            if at == tape.script.len() {
                tape.script.push(true);
            }
            let is_so = tape.script[at];
            let (greater, less) = if is_so { (self, other) } else { (other, self) };
            tape.branches.push(Branch { greater, less });
            is_so
        })
    }
}

impl Add for Traced {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::rounded(self.plus(other).node(), false)
    }
}

impl Sub for Traced {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self::rounded(self.minus(other).node(), false)
    }
}

impl Mul for Traced {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self::rounded(self.times(other).node(), true)
    }
}

/// A shipped constant as a factor.
impl Mul<f32> for Traced {
    type Output = Self;

    fn mul(self, other: f32) -> Self {
        self * Self::literal(other)
    }
}

impl PartialEq for Traced {
    fn eq(&self, _: &Self) -> bool {
        unimplemented!("no kernel compares for equality")
    }
}

impl PartialOrd for Traced {
    fn partial_cmp(&self, _: &Self) -> Option<Ordering> {
        unimplemented!("a comparison by its operator names a path")
    }

    fn gt(&self, other: &Self) -> bool {
        self.branch(*other, false)
    }

    fn lt(&self, other: &Self) -> bool {
        other.branch(*self, false)
    }

    fn ge(&self, other: &Self) -> bool {
        self.branch(*other, true)
    }

    fn le(&self, other: &Self) -> bool {
        other.branch(*self, true)
    }
}
