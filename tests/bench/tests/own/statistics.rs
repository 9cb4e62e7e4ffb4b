//! The benchmark's statistics, against textbooks.

// Requirement: E-05

use dibs_bench::statistics::{Paired, Summary, crossover, holm, repeatable_worst};

#[test]
fn a_summary_is_that_of_a_textbook() {
    let s = Summary::of(&[4.0, 2.0, 1.0, 3.0, 100.0]);
    assert_eq!((s.mean, s.median, s.max, s.p99), (22.0, 3.0, 100.0, 100.0));
    assert!((s.sd - 43.617).abs() < 1e-3, "{s:?}");
    // For 20 values: the 6th and the 15th (Conover, Practical Nonparametric Statistics).
    let s = Summary::of(&(1..=20).map(f64::from).collect::<Vec<_>>());
    assert_eq!((s.median, s.median_low, s.median_high), (10.5, 6.0, 15.0));
}

#[test]
fn the_interval_holds_the_median_as_often_as_it_says() {
    let mut rng = fastrand::Rng::with_seed(1);
    let held = (0..2_000).filter(|_| {
        let sample: Vec<f64> = (0..50).map(|_| rng.f64()).collect();
        let s = Summary::of(&sample);
        s.median_low <= 0.5 && 0.5 <= s.median_high
    });
    let share = held.count() as f64 / 2_000.0;
    assert!((0.94..0.985).contains(&share), "{share}");
}

#[test]
fn the_sign_test_and_holm_are_those_of_a_textbook() {
    let (ours, theirs) = ([1.0; 10], [2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 0.5, 1.0]);
    let paired = Paired::of(&theirs, &ours);
    // 8 of 9: 2 * (1 + 9) / 512.
    assert!((paired.p - 0.0390625).abs() < 1e-12, "{paired:?}");
    assert_eq!((paired.wins, paired.ratio.median), (0.8, 2.0));
    assert_eq!(holm(&[0.01, 0.04, 0.03]), [0.03, 0.06, 0.06]);
}

#[test]
fn the_crossover_is_where_both_cost_the_same() {
    let (ours, traversal, refit) = (vec![30.0; 9], vec![10.0; 9], vec![100.0; 9]);
    let h = crossover(&ours, &traversal, &refit, 1).median;
    assert!((h * 100.0 + 10.0 - 30.0).abs() < 1e-12);
}

#[test]
fn an_interruption_is_no_worst_case() {
    let times = [1.0, 5.0, 90.0, 2.0, 70.0, 3.0];
    assert_eq!(repeatable_worst(&times, 3), 5.0);
}
