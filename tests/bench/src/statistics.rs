//! Statistics of times: skewed, with outliers, and paired.
//!
//! The paper compares mean times by one-way ANOVA and Tukey's test. Those assume independent groups, equal variances
//! and normal residuals. Here all methods answer the same queries on the same frames, variances differ by orders of
//! magnitude, and an interrupt may make any query a hundred times slower. So the benchmark states medians with
//! order-statistic confidence intervals, the *ratio* of two methods' times on the same query, and the exact sign test
//! on it, which assumes only that queries are independent (they are: frame and pose are drawn anew for each), adjusted
//! for many comparisons after Holm. With thousands of queries every difference is significant: the ratio and its
//! interval matter.

use serde::{Deserialize, Serialize};
use statrs::distribution::{Binomial, DiscreteCDF};

/// The summary of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    pub mean: f64,
    /// Standard deviation, with `n - 1`.
    pub sd: f64,
    pub median: f64,
    /// 95 % confidence interval of the median.
    pub median_low: f64,
    pub median_high: f64,
    pub p99: f64,
    pub max: f64,
    pub n: u64,
}

impl Summary {
    /// Summarises a sample; all zeros for an empty one.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len();
        if n == 0 {
            return Self::default();
        }
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let mean = sorted.iter().sum::<f64>() / n as f64;
        let squares: f64 = sorted.iter().map(|x| (x - mean) * (x - mean)).sum();
        let (low, high) = median_ranks(n);
        Self {
            mean,
            sd: if n > 1 { (squares / (n - 1) as f64).sqrt() } else { 0.0 },
            median: middle(&sorted),
            median_low: sorted[low],
            median_high: sorted[high],
            p99: sorted[(n * 99).div_ceil(100) - 1],
            max: sorted[n - 1],
            n: n as u64,
        }
    }

    /// The summary of an exact number.
    pub fn exactly(value: f64) -> Self {
        let (median_low, median_high) = (value, value);
        let (mean, median, p99, max) = (value, value, value, value);
        Self { mean, sd: 0.0, median, median_low, median_high, p99, max, n: 1 }
    }

    /// The same of other numbers.
    pub fn map(&self, each: impl Fn(f64) -> f64) -> Self {
        let Self { mean, sd, median, median_low, median_high, p99, max, n } = *self;
        let [mean, sd, median, median_low] = [mean, sd, median, median_low].map(&each);
        let [median_high, p99, max] = [median_high, p99, max].map(each);
        Self { mean, sd, median, median_low, median_high, p99, max, n }
    }
}

fn middle(sorted: &[f64]) -> f64 {
    let half = sorted.len() / 2;
    if sorted.len() % 2 == 1 { sorted[half] } else { (sorted[half - 1] + sorted[half]) / 2.0 }
}

/// The ranks (from 0) of the order statistics that enclose the median with 95 % confidence, for any distribution: of
/// `n` values, the number below the median is binomial.
fn median_ranks(n: usize) -> (usize, usize) {
    let Ok(below) = Binomial::new(0.5, n as u64) else { return (0, n - 1) };
    let low = (below.inverse_cdf(0.025) as usize).saturating_sub(1);
    (low, n - 1 - low)
}

/// Two methods on the same queries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paired {
    /// Their times' ratio, query by query.
    pub ratio: Summary,
    /// Share of queries in which the second is faster.
    pub wins: f64,
    /// Two-sided p of the sign test, not adjusted.
    pub p: f64,
}

impl Paired {
    /// Compares `theirs / ours`.
    pub fn of(theirs: &[f64], ours: &[f64]) -> Self {
        let ratios: Vec<f64> = theirs.iter().zip(ours).map(|(a, b)| a / b).collect();
        let wins = ratios.iter().filter(|&&r| r > 1.0).count() as u64;
        let losses = ratios.iter().filter(|&&r| r < 1.0).count() as u64;
        let (untied, fewer) = (wins + losses, wins.min(losses));
        let p = match Binomial::new(0.5, untied) {
            Ok(by_chance) if untied > 0 => (2.0 * by_chance.cdf(fewer)).min(1.0),
            _ => 1.0,
        };
        Self { ratio: Summary::of(&ratios), wins: wins as f64 / ratios.len().max(1) as f64, p }
    }
}

/// Adjusts p values for multiple comparisons (Holm 1979), in the given order.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
    let mut adjusted = vec![0.0; p.len()];
    let mut least = 0.0_f64;
    for (rank, &i) in order.iter().enumerate() {
        least = least.max((p[i] * (p.len() - rank) as f64).min(1.0));
        adjusted[i] = least;
    }
    adjusted
}

/// The paper's crossover refit ratio (equation 11), from medians, with a 95 % interval by 200 bootstrap
/// resamples of the queries.
///
/// A method that refits once in `1 / h` queries takes `h * refit + traversal` a query (equation 10);
/// one that never refits takes its traversal. They are equal at
/// `h_c = (ours - traversal) / refit`: where the surface moves more often than once in `1 / h_c`
/// queries, not refitting is faster. Below 0: always; above 1: never.
pub fn crossover(ours: &[f64], traversal: &[f64], refit: &[f64], seed: u64) -> Summary {
    let n = ours.len().min(traversal.len()).min(refit.len());
    let ratio = |pick: &mut dyn FnMut(&[f64]) -> Vec<f64>| {
        let mut median = |values: &[f64]| {
            let mut picked = pick(&values[..n]);
            let (_, &mut middle, _) = picked.select_nth_unstable_by(n / 2, f64::total_cmp);
            middle
        };
        (median(ours) - median(traversal)) / median(refit)
    };
    let value = ratio(&mut <[f64]>::to_vec);
    let mut rng = fastrand::Rng::with_seed(seed);
    let mut again: Vec<f64> = (0..200)
        .map(|_| {
            let picks: Vec<usize> = (0..n).map(|_| rng.usize(..n)).collect();
            ratio(&mut |values: &[f64]| picks.iter().map(|&i| values[i]).collect())
        })
        .collect();
    again.sort_unstable_by(f64::total_cmp);
    let (median_low, median_high) = (again[5].min(value), again[194].max(value));
    Summary { median_low, median_high, n: n as u64, ..Summary::exactly(value) }
}

/// The slowest tick, where each tick's time is that of its fastest repetition: a tick that was slow once was
/// interrupted.
pub fn repeatable_worst(times: &[f64], ticks: usize) -> f64 {
    let fastest =
        |tick: usize| times[tick..].iter().step_by(ticks).copied().fold(f64::MAX, f64::min);
    (0..ticks.min(times.len())).map(fastest).fold(0.0, f64::max)
}
