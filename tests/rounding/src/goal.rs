//! A goal: an expression of recorded numbers that must not be negative, and the way to prove it.
//!
//! Gappa bounds expressions by intervals, which forgets that terms cancel. So each goal comes with one equation, by which
//! Gappa rewrites the expression into a sum in which every part is a product of numbers that are not negative. The
//! equation is not trusted: Gappa compares both sides, and Coq proves them equal.

use std::collections::{BTreeMap, BTreeSet};

use crate::tape::{Root, Tape, Traced};
use crate::term::{Monomial, Sum, number, product};

/// Half a unit in the last place of 1.
pub const U: f64 = 1.0 / 16_777_216.0;

/// `u / (1 + u)`, rounded up.
const DELTA: &str = "0x.ffffff000001p-24";

/// Half of the least positive number.
const ETA: &str = "1b-150";

/// Above every number of a goal.
const MOST: &str = "1b80";

/// A part of an error, and what it is within.
#[derive(Clone, Debug)]
pub struct Share {
    /// The constant that covers it.
    pub constant: &'static str,
    /// What it comes from.
    pub what: &'static str,
    /// How large it is at most, in units of `u` times `size`.
    pub times: f64,
    /// Products of inputs whose sizes have a sum of at most `size`: a precondition.
    of: Vec<Monomial>,
    /// A sum of products of inputs.
    size: Vec<Monomial>,
    /// The size is taken so often.
    pub room: f64,
}

/// A difference that is not negative on a path.
#[derive(Clone, Debug)]
struct Known {
    name: String,
    sum: Sum,
    /// What it is multiplied by in the equation.
    times: f64,
}

/// A goal of one path of one kernel.
#[derive(Clone, Debug)]
pub struct Goal {
    /// Its file's name.
    pub name: String,
    /// What it says, and its preconditions.
    says: &'static str,
    /// What must not be negative.
    claim: Known,
    known: Vec<Known>,
    /// Where the error goes.
    pub shares: Vec<Share>,
    /// The part of the claim that underflow may use.
    reserve: Reserve,
}

/// A product of inputs, its least value as a power of two, and how often it is taken.
#[derive(Clone, Debug, Default)]
struct Reserve {
    of: Monomial,
    least: i32,
    times: f64,
}

/// A product of inputs by their names.
#[must_use]
pub fn of(names: &[&str]) -> Monomial {
    let mut names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
    names.sort();
    names
}

impl Known {
    fn of(number: Traced, times: f64) -> Self {
        Self { name: number.name(), sum: number.sum(), times }
    }
}

impl Goal {
    /// That a number is not negative, if differences are not; the equation contains each of these so many times.
    #[must_use]
    pub fn new(name: &str, says: &'static str, claim: Traced, known: &[(Traced, f64)]) -> Self {
        Self {
            name: name.to_owned(),
            says,
            claim: Known::of(claim, 1.0),
            known: known.iter().map(|&(number, times)| Known::of(number, times)).collect(),
            shares: Vec::new(),
            reserve: Reserve::default(),
        }
    }

    /// The same goal with a part of its error: what is covered by which constant, in units of `u`, and by what size.
    #[must_use]
    pub fn share(
        mut self,
        (constant, what): (&'static str, &'static str),
        times: f64,
        of: Vec<Monomial>,
        size: Vec<Monomial>,
    ) -> Self {
        self.shares.push(Share { constant, what, times, of, size, room: 1.0 });
        self
    }

    /// The same goal with so much of the last part's size.
    #[must_use]
    pub fn of_sizes(mut self, room: f64) -> Self {
        self.shares.iter_mut().next_back().expect("a part").room = room;
        self
    }

    /// The same goal with a reserve for underflow, of at least `2^least`.
    #[must_use]
    pub fn reserve(mut self, of: Monomial, least: i32, times: f64) -> Self {
        self.reserve = Reserve { of, least, times };
        self
    }

    /// The script for Gappa.
    #[must_use]
    pub fn script(&self, tape: &Tape) -> String {
        let (parts, room) = self.parts(&Signs::of(tape));
        let roots = (1..=tape.roots.len()).map(|at| format!("root{at} <> 0"));
        let roots = roots.collect::<Vec<_>>().join(", ");
        let only = if roots.is_empty() { roots } else { format!(" {{ {roots} }}") };
        let equation = format!("claim -> {}{only};\n", parts.join("\n  + "));
        self.with_goal(tape, &room, "claim >= 0", &equation)
    }

    /// A script that asks for the coefficients of the shares' parts, in their order; and of each the share's number, and
    /// whether it may have either sign.
    #[must_use]
    pub fn question(&self, tape: &Tape) -> (String, Vec<(usize, bool)>) {
        let signs = Signs::of(tape);
        let [_, rest] = self.rest();
        let coefficients = rest.coefficients();
        let parts = (0..).zip(&self.shares);
        let parts = parts.flat_map(|(at, share)| share.of.iter().map(move |part| (at, part)));
        let (mut asked, mut of) = (Vec::new(), Vec::new());
        for (at, part) in parts.filter(|(_, part)| coefficients.contains_key(*part)) {
            asked.push(format!("{} in ?", coefficients[part]));
            of.push((at, signs.has(part)));
        }
        (self.with_goal(tape, &[], &asked.join(" /\\\n  "), ""), of)
    }

    fn with_goal(&self, tape: &Tape, room: &[String], goal: &str, equation: &str) -> String {
        let names = |names: &[String], bound: &str| {
            names.iter().map(|name| format!("|{name}| <= {bound}")).collect::<Vec<_>>()
        };
        let inputs =
            tape.inputs.iter().map(|(name, low, high)| format!("{name} in [{low}, {high}]"));
        let roots = (1..=tape.roots.len()).map(|at| format!("exact{at} in [1b-100, 1b70]"));
        let known = self.known.iter().map(|known| format!("{} in [0, {MOST}]", known.name));
        let mut given = names(&tape.deltas, DELTA);
        given.extend(names(&tape.etas, ETA));
        given.extend(inputs.chain(roots).chain(known).chain(room.iter().cloned()));
        let says = self.says.lines().map(|line| format!("# {}", line.trim()));
        let shares = (1..).zip(&self.shares).map(|(at, share)| {
            format!("share{at} = {} * 1b-24; # {}: {}", share.times, share.constant, share.what)
        });
        let mut lines: Vec<String> = says.chain(shares).collect();
        lines.extend(tape.definitions.iter().cloned());
        lines.push(format!("claim = {};", self.claim.name));
        lines.push(format!("{{\n  {}\n  -> {goal}\n}}", given.join(" /\\\n  ")));
        lines.push(equation.to_owned());
        lines.extend((1..).zip(&tape.roots).flat_map(|(at, root)| hints(at, root)));
        lines.join("\n") + "\n"
    }

    /// The claim without what is known not to be negative: what stems from underflow, and the rest.
    fn rest(&self) -> [Sum; 2] {
        let less =
            |rest: Sum, known: &Known| rest.plus(&known.sum.times(&Sum::number(-known.times)));
        self.known.iter().fold(self.claim.sum.clone(), less).split()
    }

    /// The parts that add up to the claim, none of them negative; and the preconditions by which they are not.
    fn parts(&self, signs: &Signs) -> (Vec<String>, Vec<String>) {
        let (mut parts, mut room) = (Vec::new(), Vec::new());
        let known =
            self.known.iter().map(|known| format!("{} * {}", number(known.times), known.name));
        parts.extend(known);
        let [tiny, rest] = self.rest();
        let mut coefficients = rest.coefficients();
        // What is taken from the coefficient of a size.
        let mut taken: BTreeMap<&Monomial, String> = BTreeMap::new();
        for (at, share) in (1..).zip(&self.shares) {
            let times = format!("share{at}");
            let mut within = Vec::new();
            for monomial in &share.of {
                let factor = coefficients.remove(monomial).unwrap_or_else(|| "0".to_owned());
                let text = product(monomial);
                if signs.has(monomial) {
                    let size = format!("size_{}", monomial.join("_"));
                    for sign in ["+", "-"] {
                        room.push(format!("{size} {sign} {text} in [0, {MOST}]"));
                        parts.push(format!(
                            "({times} {sign} ({factor})) * 1b-1 * ({size} {sign} {text})"
                        ));
                    }
                    within.push(size);
                } else {
                    parts.push(format!("({times} + ({factor})) * ({text})"));
                    within.push(format!("({text})"));
                }
            }
            let size: Vec<String> = share.size.iter().map(product).collect();
            let (size, of) = (size.join(" + "), within.join(" + "));
            let left = format!("({} * ({size}) - ({of}))", number(share.room));
            room.push(format!("{left} in [0, {MOST}]"));
            parts.push(format!("{times} * {left}"));
            for monomial in &share.size {
                let less = format!(" - {} * {times}", number(share.room));
                taken.entry(monomial).or_default().push_str(&less);
            }
        }
        let Reserve { of, least, times } = &self.reserve;
        let (times, text) = (number(*times), product(of));
        taken.entry(of).or_default().push_str(&format!(" - {times}"));
        if !of.is_empty() {
            room.push(format!("{text} in [1b{least}, {MOST}]"));
        }
        parts.push(format!("({times} * ({text}) + ({}))", tiny.text()));
        for (monomial, less) in taken {
            let factor = coefficients.remove(monomial).unwrap_or_else(|| "0".to_owned());
            parts.push(format!("({factor}{less}) * ({})", product(monomial)));
        }
        parts.extend(
            coefficients
                .iter()
                .map(|(monomial, factor)| format!("({factor}) * ({})", product(monomial))),
        );
        (parts, room)
    }
}

/// Which inputs may be negative.
struct Signs<'t>(BTreeSet<&'t String>);

impl<'t> Signs<'t> {
    fn of(tape: &'t Tape) -> Self {
        let signed = tape.inputs.iter().filter(|(_, low, _)| low.starts_with('-'));
        Self(signed.map(|(name, ..)| name).collect())
    }

    /// Whether a product may be negative.
    fn has(&self, monomial: &Monomial) -> bool {
        let is_odd = |name| monomial.iter().filter(|&other| other == name).count() % 2 == 1;
        monomial.iter().any(|name| self.0.contains(name) && is_odd(name))
    }
}

/// What tells Gappa the relative error of a root's argument, a sum of squares: the error of a sum is no larger than that
/// of one square.
fn hints(at: usize, root: &Root) -> [String; 3] {
    let Root { of, sum } = root;
    let exact = format!("exact{at}");
    let error = sum.plus(&sum.exact().times(&Sum::number(-1.0)));
    let most = sum.0.iter().map(|term| term.factors.len()).max().unwrap_or_default() as f64;
    // A little more than as many roundings, and the same for underflow.
    let little = U / 1_048_576.0;
    let (share, reserve) = (number(most * (U + little)), number(little));
    let [tiny, error] = error.split();
    let side = |sign: &str| {
        let parts = error.coefficients().into_iter().map(|(monomial, factor)| {
            format!("({share} {sign} ({factor})) * ({})", product(&monomial))
        });
        let parts = parts.collect::<Vec<_>>().join(" + ");
        format!("({parts} + ({reserve} * {exact} {sign} ({}))) / {exact}", tiny.text())
    };
    let relative = format!("({of} - {exact}) / {exact}");
    [
        format!("{relative} -> ({share} + {reserve}) - {} {{ {exact} <> 0 }};", side("-")),
        format!("{relative} -> {} - ({share} + {reserve}) {{ {exact} <> 0 }};", side("+")),
        format!("ratio{at} -> 1 + (computed{at} - root{at}) / root{at} {{ root{at} <> 0 }};"),
    ]
}
