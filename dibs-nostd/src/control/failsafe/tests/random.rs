//! Random runs of the machine: each step's state is compared with the one computed from all steps before it.

// Requirement: C-01

use super::*;

/// One step of a random run.
#[derive(Clone, Copy, Debug)]
struct Step {
    wait: u32,
    new_frame: bool,
    delay: u32,
    link: Link,
    query_failed: bool,
    is_tree_corrupt: bool,
    acknowledge: bool,
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let link = prop_oneof![
        8 => Just(GOOD),
        1 => (0_u32..120, 0_u32..170, 0_u32..12)
            .prop_map(|(silence, heartbeat, rejections)| Link {
                silence: Millis(silence),
                heartbeat: Millis(heartbeat),
                rejections,
                ..GOOD
            }),
    ];
    let step = (1_u32..80, any::<bool>(), 0_u32..70, link, 0_u32..40, any::<bool>()).prop_map(
        |(wait, new_frame, delay, link, fault, acknowledge)| Step {
            wait,
            new_frame,
            delay,
            link,
            query_failed: fault == 0,
            is_tree_corrupt: fault == 1,
            acknowledge,
        },
    );
    prop::collection::vec(step, 1..200)
}

fn run(steps: &[Step], limits: Limits, start: u32) -> (Vec<Observation>, Vec<Verdict>, Vec<bool>) {
    let mut machine = FailSafe::new(limits);
    let (mut now, mut epoch, mut stamp) = (Millis(start), 0_u32, None);
    let mut ageing = StampAge::default();
    let (mut observations, mut verdicts, mut acknowledged) = (Vec::new(), Vec::new(), Vec::new());
    for step in steps {
        now = now.after(Millis(step.wait));
        if step.new_frame {
            epoch = epoch.wrapping_add(1);
            stamp = Some(now.before(Millis(step.delay)));
            ageing = StampAge::default();
        }
        let frame = stamp.map(|received| {
            ageing = ageing.at(now, received);
            FrameAge { epoch, received, age: ageing.oldest }
        });
        let Step { link, query_failed, is_tree_corrupt, .. } = *step;
        let no_answer = query_failed.then_some(QUERY);
        let seen = Observation { frame, lag: None, link, no_answer, is_tree_corrupt };
        verdicts.push(machine.step(&seen));
        acknowledged.push(step.acknowledge && machine.acknowledge().is_ok());
        observations.push(seen);
    }
    (observations, verdicts, acknowledged)
}

/// Whether an observation is beyond its first (`strict`) or second limits, computed anew.
fn is_beyond(seen: &Observation, second: bool) -> bool {
    let limit = |pair: ThresholdPair| if second { pair.safe() } else { pair.degraded() };
    let most = if second { REJECTIONS.safe() } else { REJECTIONS.degraded() };
    let Some(frame) = seen.frame else { return true };
    seen.no_answer.is_some()
        || seen.is_tree_corrupt
        || frame.age > limit(AGE)
        || seen.link.silence > limit(SILENCE)
        || seen.link.heartbeat > limit(HEARTBEAT)
        || seen.link.rejections > most
}

proptest! {
    #[test]
    fn a_random_run_keeps_the_rules(
        steps in steps(),
        frames in 1_u16..4,
        dwell in 0_u32..6,
        automatic in any::<bool>(),
        start in any::<u32>(),
    ) {
        let (seen, verdicts, acknowledged) =
            run(&steps, limits(frames, automatic).dwell(dwell), start);
        for (at, verdict) in verdicts.iter().enumerate() {
            // An observation beyond a limit always has the state that the limit requires.
            prop_assert!(!is_beyond(&seen[at], true) || verdict.state == State::Safe);
            prop_assert!(!is_beyond(&seen[at], false) || verdict.state != State::Nominal);
            prop_assert_eq!(verdict.cause.is_none(), verdict.state == State::Nominal);

            let before = if at == 0 { State::Safe } else { verdicts[at - 1].state };
            if verdict.state >= before {
                continue;
            }
            // The state improves only after enough new frames, all clear, and an acknowledgement.
            prop_assert_eq!(verdict.state, State::Nominal);
            let clear: Vec<usize> =
                (0..=at).rev().take_while(|&i| !is_beyond(&seen[i], false)).collect();
            let epoch = |i: usize| seen[i].frame.map(|frame| frame.epoch);
            let is_new = |i: usize| i == 0 || epoch(i) != epoch(i - 1);
            let new = clear.iter().filter(|&&i| is_new(i)).count();
            prop_assert!(new >= usize::from(frames));
            prop_assert!(clear.len() > dwell as usize);
            if before == State::Safe && !automatic {
                prop_assert!(clear.iter().any(|&i| i < at && acknowledged[i]));
            }
        }
        // No later than the rule allows, either.
        let epoch = |i: usize| seen[i].frame.map(|frame| frame.epoch);
        for (at, verdict) in verdicts.iter().enumerate() {
            if verdict.state == State::Degraded {
                let clear: Vec<usize> =
                    (0..=at).rev().take_while(|&i| !is_beyond(&seen[i], false)).collect();
                let new = clear.iter().filter(|&&i| epoch(i) != epoch(i - 1)).count();
                prop_assert!(new < usize::from(frames) || clear.len() <= dwell as usize);
            }
        }
    }

    #[test]
    fn where_the_clock_starts_does_not_matter(steps in steps(), start in any::<u32>()) {
        let (_, expected, _) = run(&steps, limits(2, false), 0);
        let (_, shifted, _) = run(&steps, limits(2, false), start);
        prop_assert_eq!(expected, shifted);
    }
}
