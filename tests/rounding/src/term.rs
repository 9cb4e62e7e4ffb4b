//! Recorded numbers as sums of terms: exact products of inputs, each times the factors that roundings have added.
//!
//! This is how an error is bounded without loss: after the exact value is subtracted, each product of inputs is left
//! with a small factor of its own.

use std::collections::BTreeMap;

/// Inputs that are multiplied, sorted; empty for the number 1.
pub type Monomial = Vec<String>;

/// A number times inputs times factors.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    pub scale: f64,
    pub inputs: Monomial,
    /// Expressions near 1, or near 0 where a product has underflown; sorted.
    pub factors: Vec<String>,
}

/// A sum of terms, no two of which differ by their scale alone.
#[derive(Clone, Debug, Default)]
pub struct Sum(pub Vec<Term>);

impl Sum {
    pub fn number(scale: f64) -> Self {
        Self::one(scale, &[])
    }

    pub fn input(name: &str) -> Self {
        Self::one(1.0, &[name])
    }

    fn one(scale: f64, inputs: &[&str]) -> Self {
        let inputs = inputs.iter().map(|&name| name.to_owned()).collect();
        Self(vec![Term { scale, inputs, factors: Vec::new() }]).united()
    }

    pub fn plus(&self, other: &Self) -> Self {
        Self([&self.0[..], &other.0[..]].concat()).united()
    }

    pub fn times(&self, other: &Self) -> Self {
        let product = |a: &Term, b: &Term| {
            let (mut inputs, mut factors) =
                ([&a.inputs[..], &b.inputs].concat(), [&a.factors[..], &b.factors].concat());
            inputs.sort();
            factors.sort();
            Term { scale: a.scale * b.scale, inputs, factors }
        };
        let terms = self.0.iter().flat_map(|a| other.0.iter().map(move |b| product(a, b)));
        Self(terms.collect()).united()
    }

    pub fn factor(mut self, factor: &str) -> Self {
        for term in &mut self.0 {
            term.factors.push(factor.to_owned());
            term.factors.sort();
        }
        self
    }

    /// Adds up terms of the same inputs and factors, and drops those that cancel.
    fn united(self) -> Self {
        let mut sums: BTreeMap<(Monomial, Vec<String>), f64> = BTreeMap::new();
        for Term { scale, inputs, factors } in self.0 {
            *sums.entry((inputs, factors)).or_default() += scale;
        }
        let terms = sums.into_iter().filter(|&(_, scale)| scale != 0.0);
        Self(terms.map(|((inputs, factors), scale)| Term { scale, inputs, factors }).collect())
    }

    /// The coefficient of each product of inputs, as an expression.
    pub fn coefficients(&self) -> BTreeMap<Monomial, String> {
        let mut coefficients: BTreeMap<Monomial, Vec<String>> = BTreeMap::new();
        for term in &self.0 {
            let text = product(std::iter::once(&number(term.scale)).chain(&term.factors));
            coefficients.entry(term.inputs.clone()).or_default().push(text);
        }
        coefficients.into_iter().map(|(inputs, texts)| (inputs, texts.join(" + "))).collect()
    }

    /// The terms that stem from products' underflow, and the others.
    pub fn split(&self) -> [Self; 2] {
        let is_tiny = |term: &Term| term.factors.iter().any(|factor| factor.starts_with("eta"));
        let (tiny, others) = self.0.iter().cloned().partition(is_tiny);
        [Self(tiny), Self(others)]
    }

    /// The exact value: without factors and underflow.
    pub fn exact(&self) -> Self {
        let [_, Self(terms)] = self.split();
        let bare = |term: Term| Term { factors: Vec::new(), ..term };
        Self(terms.into_iter().map(bare).collect()).united()
    }

    /// The sum as an expression.
    pub fn text(&self) -> String {
        if self.0.is_empty() {
            return "0".to_owned();
        }
        let terms = self.0.iter().map(|term| {
            let scale = if term.scale == 1.0 && !term.inputs.is_empty() {
                None
            } else {
                Some(number(term.scale))
            };
            product(scale.iter().chain(&term.inputs).chain(&term.factors))
        });
        terms.collect::<Vec<_>>().join(" + ")
    }
}

/// A product as an expression.
pub fn product<'t>(factors: impl IntoIterator<Item = &'t String>) -> String {
    let factors: Vec<&str> = factors.into_iter().map(String::as_str).collect();
    if factors.is_empty() { "1".to_owned() } else { factors.join(" * ") }
}

/// A number as Gappa reads it, exactly: a whole number times a power of two.
pub fn number(value: f64) -> String {
    let (mut whole, mut power) = (value, 0);
    while whole.fract() != 0.0 {
        (whole, power) = (whole * 2.0, power - 1);
    }
    let text = if power == 0 { format!("{whole}") } else { format!("{whole}b{power}") };
    if value < 0.0 { format!("({text})") } else { text }
}
