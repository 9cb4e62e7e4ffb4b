//! Compares the machine with its table, and with a second implementation that stores all steps.
//!
//! One file, because table, second implementation and comparison need each other.

// Requirement: C-01

extern crate std;

mod random;

use std::vec::Vec;

use proptest::prelude::*;

use super::{
    FailSafe, LimitError, Limits, Link, LinkStatus, Observation, State, ThresholdPair, Verdict,
};
use crate::receive::BusHealth;
use crate::surface::{FrameAge, Millis, StampAge};
use crate::unavailable::{QueryError, Unavailable};

const QUERY: Unavailable = Unavailable::Query(QueryError::Corrupt { row: 7 });

const AGE: ThresholdPair = pair(50, 200);
const SILENCE: ThresholdPair = pair(20, 100);
const HEARTBEAT: ThresholdPair = pair(30, 150);
const REJECTIONS: ThresholdPair<u32> = count(3, 9);
const TRANSIT: ThresholdPair = pair(300, 900);
const SOURCE_AGE: ThresholdPair = pair(40, 80);
const FORGERIES: ThresholdPair<u32> = count(5, 50);
const SPEED: f32 = 0.125;

const fn pair(degraded: u32, safe: u32) -> ThresholdPair {
    match ThresholdPair::new(Millis(degraded), Millis(safe)) {
        Ok(pair) => pair,
        Err(_) => panic!("limits in the wrong order"),
    }
}

const fn count(degraded: u32, safe: u32) -> ThresholdPair<u32> {
    match ThresholdPair::count(degraded, safe) {
        Ok(pair) => pair,
        Err(_) => panic!("limits in the wrong order"),
    }
}

fn limits(frames: u16, automatic: bool) -> Limits {
    let limits = Limits::new(AGE, SPEED)
        .unwrap()
        .silence(SILENCE)
        .heartbeat(HEARTBEAT)
        .rejections(REJECTIONS)
        .transit(TRANSIT)
        .source_age(SOURCE_AGE)
        .unwrap()
        .forgeries(FORGERIES)
        .unwrap()
        .dwell(0)
        .recovery(frames)
        .unwrap();
    if automatic { limits.automatic() } else { limits }
}

const GOOD: Link = Link::CLEAR;

/// A step at `now` with a surface of this epoch and age.
fn seen(now: u32, epoch: u32, age: u32) -> Observation {
    let (now, age) = (Millis(now), Millis(age));
    Observation {
        frame: Some(FrameAge { epoch, received: now.before(age), age }),
        lag: None,
        link: GOOD,
        no_answer: None,
        is_tree_corrupt: false,
    }
}

fn machine(state: State, limits: Limits) -> FailSafe {
    let mut machine = FailSafe::new(limits);
    for epoch in 0..=100 {
        machine.step(&seen(epoch, epoch, 0));
        let _ = machine.acknowledge();
    }
    let age = match state {
        State::Nominal => 0,
        State::Degraded => 51,
        State::Safe => 201,
    };
    assert_eq!(machine.step(&seen(1000, 100, age)).state, state);
    machine
}

/// Every way in which an input can require a level, with its cause.
fn requests() -> Vec<(State, Observation, Option<Unavailable>)> {
    use State::{Degraded, Nominal, Safe};
    let with = |link: Link| Observation { link, ..seen(2000, 100, 0) };
    let mut all = Vec::new();
    all.push((Safe, Observation { frame: None, ..seen(2000, 0, 0) }, Some(Unavailable::NoSurface)));
    all.push((Safe, Observation { no_answer: Some(QUERY), ..seen(2000, 100, 0) }, Some(QUERY)));
    all.push((
        Safe,
        Observation { is_tree_corrupt: true, ..seen(2000, 100, 0) },
        Some(Unavailable::CorruptTree),
    ));
    for (level, age) in [(Nominal, 50), (Degraded, 51), (Degraded, 200), (Safe, 201)] {
        let cause = (level != Nominal).then_some(Unavailable::Stale { age: Millis(age) });
        all.push((level, seen(2000, 100, age), cause));
    }
    for (level, silence) in [(Nominal, 20), (Degraded, 21), (Degraded, 100), (Safe, 101)] {
        let silence = Millis(silence);
        let cause = (level != Nominal).then_some(Unavailable::LinkLost { silence });
        all.push((level, with(Link { silence, ..GOOD }), cause));
    }
    for (level, silence) in [(Nominal, 30), (Degraded, 31), (Degraded, 150), (Safe, 151)] {
        let silence = Millis(silence);
        let cause = (level != Nominal).then_some(Unavailable::HeartbeatLost { silence });
        all.push((level, with(Link { heartbeat: silence, ..GOOD }), cause));
    }
    for (level, streak) in [(Nominal, 3), (Degraded, 4), (Degraded, 9), (Safe, 10)] {
        let cause = (level != Nominal).then_some(Unavailable::Rejections { streak });
        all.push((level, with(Link { rejections: streak, ..GOOD }), cause));
    }
    for (level, transit) in [(Nominal, 300), (Degraded, 301), (Degraded, 900), (Safe, 901)] {
        let transit = Millis(transit);
        let cause = (level != Nominal).then_some(Unavailable::Delayed { transit });
        all.push((level, with(Link { transit, ..GOOD }), cause));
    }
    for (level, age) in [(Nominal, 40), (Degraded, 41), (Degraded, 80), (Safe, 81)] {
        let age = Millis(age);
        let cause = (level != Nominal).then_some(Unavailable::SourceStale { age });
        all.push((level, with(Link { source_age: age, ..GOOD }), cause));
    }
    for (level, count) in [(Nominal, 5), (Degraded, 6), (Degraded, 50), (Safe, 51)] {
        let cause = (level != Nominal).then_some(Unavailable::Forgeries { count });
        all.push((level, with(Link { forgeries: count, ..GOOD }), cause));
    }
    all.push((
        Safe,
        with(Link { silence: Millis::MAX, ..GOOD }),
        Some(Unavailable::LinkLost { silence: Millis::MAX }),
    ));
    all
}

#[test]
fn every_input_at_each_limit_leads_from_each_state_to_the_state_of_the_table() {
    for before in [State::Nominal, State::Degraded, State::Safe] {
        for (level, observation, cause) in requests() {
            for automatic in [false, true] {
                let mut machine = machine(before, limits(3, automatic));
                let verdict = machine.step(&observation);
                // Without new frames no state improves.
                assert_eq!(verdict.state, before.max(level), "{before:?}, {observation:?}");
                if level == verdict.state {
                    assert_eq!(verdict.cause, cause, "{before:?}, {observation:?}");
                } else {
                    assert!(verdict.cause.is_some(), "the last cause stays");
                }
            }
        }
    }
}

#[test]
fn a_machine_keeps_the_limits_that_it_was_given() {
    let machine = FailSafe::new(limits(7, true));
    let kept = machine.limits();
    assert_eq!((kept.age(), kept.recovery_frames(), kept.is_automatic()), (AGE, 7, true));
}

#[test]
fn recovery_takes_its_frames_in_a_row_and_from_safe_an_acknowledgement() {
    for before in [State::Degraded, State::Safe] {
        for frames in [1_u16, 2, 5] {
            for automatic in [false, true] {
                let mut machine = machine(before, limits(frames, automatic));
                let mut now = 3000;
                // One frame short, then a step that is not clear: the run starts again.
                for epoch in 1..frames {
                    now += 1;
                    assert_eq!(machine.step(&seen(now, 100 + u32::from(epoch), 0)).state, before);
                    assert!(machine.acknowledge().is_err(), "too early");
                }
                let broken =
                    Observation { link: Link { rejections: 4, ..GOOD }, ..seen(now + 1, 200, 0) };
                assert_eq!(machine.step(&broken).state, before);
                for epoch in 1..frames {
                    now += 2;
                    assert_eq!(machine.step(&seen(now, 200 + u32::from(epoch), 0)).state, before);
                    // The same frame again does not count.
                    assert_eq!(
                        machine.step(&seen(now + 1, 200 + u32::from(epoch), 1)).state,
                        before
                    );
                }
                let verdict = machine.step(&seen(now + 2, 300, 0));
                if before == State::Degraded || automatic {
                    assert_eq!((verdict.state, verdict.cause), (State::Nominal, None));
                    continue;
                }
                assert_eq!(verdict.state, State::Safe);
                assert!(verdict.waits_for_acknowledgement);
                assert_eq!(verdict.cause, Some(Unavailable::Unacknowledged));
                machine.acknowledge().unwrap();
                // A fault before the next step voids the acknowledgement, which is no longer all that is missing.
                let verdict = machine.step(&broken);
                assert_eq!(verdict.state, State::Safe);
                assert_eq!(verdict.cause, Some(Unavailable::Stale { age: Millis(201) }));
                for epoch in 0..u32::from(frames) {
                    now += 1;
                    assert_eq!(machine.step(&seen(now, 400 + epoch, 0)).state, State::Safe);
                }
                machine.acknowledge().unwrap();
                let verdict = machine.step(&seen(now + 1, 500, 0));
                assert_eq!((verdict.state, verdict.cause), (State::Nominal, None));
                let refused = machine.acknowledge().unwrap_err();
                let words = "the state is not safe: there is nothing to acknowledge";
                assert_eq!(refused.state, State::Nominal);
                assert_eq!(std::format!("{refused}"), words);
            }
        }
    }
}

/// An input crosses its limit as often as it can: the state gets worse at once, and better no sooner than allowed.
#[test]
fn the_state_improves_no_more_often_than_the_dwell_allows() {
    let rejected =
        |now, rejections| Observation { link: Link { rejections, ..GOOD }, ..seen(now, now, 0) };
    let changes = |limits: Limits| {
        let mut machine = FailSafe::new(limits);
        let mut changes: Vec<(u32, State)> = Vec::new();
        let mut calm = 0;
        for now in 0..20_000 {
            // The attacker sees the state, and trips a limit as soon as it is nominal.
            let is_attacked = machine.state() == State::Nominal;
            calm = if is_attacked { 0 } else { calm + 1 };
            let before = machine.state();
            let state = machine.step(&rejected(now, if is_attacked { 10 } else { 0 })).state;
            assert!(!is_attacked || state == State::Safe, "safe is immediate");
            if state != before {
                assert!(state == State::Safe || calm > limits.dwell_steps());
                changes.push((now, state));
            }
        }
        changes.len()
    };
    assert!(changes(limits(1, true)) > 15_000, "without a dwell");
    assert!((350..=400).contains(&changes(limits(1, true).dwell(100))));
    let by_default = Limits::new(AGE, SPEED).unwrap().rejections(REJECTIONS).automatic();
    assert!((35..=40).contains(&changes(by_default)));
    // An acknowledgement must wait, too.
    let mut machine = FailSafe::new(limits(1, false).dwell(2));
    for now in 0..3 {
        let steps = if now == 0 { 3 } else { 3 - now };
        let early = machine.acknowledge();
        assert_eq!(early.map_err(|error| error.steps), Err(steps));
        assert_eq!(machine.step(&seen(now, now, 0)).waits_for_acknowledgement, now == 2);
    }
    machine.acknowledge().unwrap();
    assert_eq!(machine.step(&seen(3, 3, 0)).state, State::Nominal);
}

#[test]
fn safe_comes_exactly_one_tick_after_the_limit_whatever_the_clock_shows() {
    for start in [0, 1, u32::MAX - 300, u32::MAX - 200, u32::MAX, i32::MAX as u32 - 100] {
        let mut machine = FailSafe::new(Limits::new(AGE, SPEED).unwrap().dwell(0).automatic());
        let mut states = Vec::new();
        for tick in 0..400_u32 {
            let now = start.wrapping_add(tick);
            states.push(machine.step(&seen(now, 1, tick)).state);
        }
        let first = |state| states.iter().position(|&s| s == state);
        assert_eq!(first(State::Nominal), Some(0));
        assert_eq!(first(State::Degraded), Some(AGE.degraded().0 as usize + 1));
        assert_eq!(first(State::Safe), Some(AGE.safe().0 as usize + 1));
        assert!(states[AGE.safe().0 as usize + 1..].iter().all(|&s| s == State::Safe));
        // A surface that looks fresh again does not recover the machine.
        assert_eq!(machine.step(&seen(start, 1, 0)).state, State::Safe);
    }
}

#[test]
fn the_margin_is_age_times_speed_in_every_state_that_acts() {
    let mut machine = FailSafe::new(Limits::new(AGE, SPEED).unwrap().dwell(0).automatic());
    let mut before = -1.0;
    for age in 0..=AGE.safe().0 {
        let verdict = machine.step(&seen(1000 + age, 1, age));
        let exact = f64::from(age) * f64::from(SPEED);
        assert!(f64::from(verdict.margin) >= exact, "rounded up");
        assert!(f64::from(verdict.margin) <= exact * 1.000_001);
        assert!(verdict.margin > before, "grows");
        before = verdict.margin;
    }
    let limits = Limits::new(pair(1, i32::MAX as u32 - 1), 0.3).unwrap();
    for age in [16_777_217, 33_554_435, i32::MAX as u32 - 1] {
        assert!(f64::from(limits.margin(Millis(age))) >= f64::from(age) * f64::from(0.3_f32));
    }
}

/// The margin covers the transit time as it covers the age, and an unknown transit time is beyond every limit. Only an
/// explicit choice leaves it out.
#[test]
fn the_margin_covers_the_way_unless_that_is_left_out() {
    let limits = Limits::new(AGE, SPEED).unwrap().dwell(0).automatic();
    let with = |transit, lag| Observation {
        lag,
        link: Link { transit: Millis(transit), ..GOOD },
        ..seen(1000, 1, 30)
    };
    let step = |limits, seen| {
        let verdict = FailSafe::new(limits).step(&seen);
        (verdict.state, verdict.margin)
    };
    let margin = |millis| limits.margin(Millis(millis));
    assert_eq!(step(limits, with(20, None)), (State::Nominal, margin(50)));
    // An extrapolated surface covers its age itself, but not the transit time.
    assert_eq!(step(limits, with(20, Some(Millis(0)))), (State::Nominal, margin(20)));
    assert_eq!(step(limits, with(20, Some(Millis(7)))), (State::Nominal, margin(27)));
    // By default the limits are those on age.
    for transit in [AGE.safe().0 + 1, 1 << 30, u32::MAX] {
        assert_eq!(step(limits, with(transit, None)).0, State::Safe, "{transit}");
        assert_eq!(
            step(limits.without_transit(), with(transit, None)),
            (State::Nominal, margin(30))
        );
    }
    let verdict = FailSafe::new(limits).step(&with(AGE.safe().0 + 1, None));
    let transit = Millis(AGE.safe().0 + 1);
    assert_eq!(verdict.cause, Some(Unavailable::Delayed { transit }));
    let own = limits.transit(pair(5, 10));
    assert_eq!(step(own, with(10, None)).1, margin(40));
    assert_eq!(step(own, with(11, None)).0, State::Safe);
}

#[test]
fn a_slow_second_core_is_not_an_old_surface() {
    let mut machine = FailSafe::new(Limits::new(AGE, SPEED).unwrap().dwell(0).automatic());
    // The receiver's clock is ahead by one.
    let age = StampAge::default().at(Millis(1000), Millis(1001)).oldest;
    let verdict = machine.step(&seen(1000, 1, age.0));
    assert_eq!((verdict.state, verdict.margin), (State::Nominal, 0.0));
}

#[test]
fn limits_that_no_machine_can_have_are_named() {
    assert_eq!(ThresholdPair::count(5, 4), Err(LimitError::Order { degraded: 5, safe: 4 }));
    let long = 1 << 31;
    assert_eq!(
        ThresholdPair::new(Millis(5), Millis(long)),
        Err(LimitError::TooLong { safe: long })
    );
    assert_eq!(Limits::new(ThresholdPair::OFF, 0.0), Err(LimitError::TooLong { safe: u32::MAX }));
    // No frame is published whose source was older.
    for safe in [65_534, 65_535, 120_000].map(Millis) {
        let never = ThresholdPair::new(Millis(100), safe).unwrap();
        let refused = limits(1, false).source_age(never);
        assert_eq!(refused, Err(LimitError::Untrippable { safe: safe.0 }));
    }
    assert!(limits(1, false).source_age(pair(100, 65_533)).is_ok());
    assert!(limits(1, false).source_age(ThresholdPair::OFF).is_ok());
    for tissue_speed in [-1.0, f32::INFINITY] {
        assert_eq!(Limits::new(AGE, tissue_speed), Err(LimitError::Speed { tissue_speed }));
    }
    assert!(matches!(Limits::new(AGE, f32::NAN), Err(LimitError::Speed { .. })));
    assert_eq!(limits(1, false).recovery(0), Err(LimitError::Recovery { frames: 0 }));
    let most = Link::MOST_FORGERIES;
    let untrippable = Err(LimitError::Untrippable { safe: most });
    assert_eq!(limits(1, false).forgeries(count(0, most)), untrippable);
    assert!(limits(1, false).forgeries(count(0, most - 1)).is_ok());
    assert!(limits(1, false).forgeries(ThresholdPair::OFF).is_ok());
}

/// Heartbeats are lost while good frames continue: for more than the clock's whole range the machine stays safe, and a
/// single flipped bit of a stamp does not recover it.
#[test]
fn lost_heartbeats_stay_lost_over_the_whole_range_of_the_clock() {
    for (start, step) in [(0_u32, 0x0FFF_FFFF_u32), (77, 0x7FFF_FFF0), (u32::MAX - 3, 0x1234_5678)]
    {
        let link = LinkStatus::new();
        link.set(&health(start, start));
        let mut machine = FailSafe::new(limits(1, true));
        let mut now = start;
        assert_eq!(machine.step(&observe(now, 0, link.read(Millis(now)))).state, State::Nominal);
        for epoch in 1..100 {
            now = now.wrapping_add(step);
            link.set(&health(now, start));
            let verdict = machine.step(&observe(now, epoch, link.read(Millis(now))));
            assert_eq!(verdict.state, State::Safe, "{start}: {epoch} steps of {step}");
            // Includes the ticks at which the clock wraps around to the last heartbeat.
            let again = link.read(Millis(start.wrapping_add(epoch % 40).wrapping_sub(20)));
            if u64::from(epoch) * u64::from(step) > 1 << 32 {
                assert_eq!(again.heartbeat, Millis::MAX, "{start}: {epoch} steps of {step}");
            }
        }
        // A heartbeat ends it.
        now = now.wrapping_add(1);
        link.set(&health(now, now));
        assert_eq!(machine.step(&observe(now, 1000, link.read(Millis(now)))).state, State::Nominal);
    }
}

/// A bus on which a packet and a heartbeat came at these times.
fn health(packet: u32, heartbeat: u32) -> BusHealth {
    BusHealth {
        packet: Some(Millis(packet)),
        heartbeat: Some(Millis(heartbeat)),
        rejections: 0,
        forgeries: 0,
        transit: Millis(0),
        source_age: Millis(0),
    }
}

/// A new frame at `now`, with this link.
fn observe(now: u32, epoch: u32, link: Link) -> Observation {
    Observation { link, ..seen(now, epoch, 0) }
}
