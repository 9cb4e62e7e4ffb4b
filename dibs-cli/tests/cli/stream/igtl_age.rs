//! The age of frames that a bridge sends on.

// Requirement: B-10

use std::io::Write;
use std::net::TcpListener;
use std::thread;
use std::time::{Duration, Instant};

use dibs_build::Motion;
use dibs_build::glam::{Quat, Vec3};

use super::igtl::{accepted, bridged, bridged_to, organ};
use super::igtl_messages::{array, message, timed};
use super::igtl_pose::{pose_message, posed};
use super::{FRAMES, assert_all, heart, totals};

/// A message whose header's time says that it was half a second on its way makes a frame of that age.
#[test]
fn frames_are_as_old_as_their_headers_say() {
    const LATE: usize = 15;
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("--from igtl:{}", server.local_addr().unwrap());
    let (seen, output, _) = bridged(folder, &line, || {
        let mut peer = accepted(&server);
        let start = Instant::now();
        for (number, frame) in frames.iter().enumerate() {
            if number == LATE {
                // What is held up is late by as long.
                thread::sleep(Duration::from_millis(500));
            }
            // The peer's clock has a beginning of its own.
            let time = start.elapsed().as_secs_f64() + if number < LATE { 1000.5 } else { 1000.0 };
            let message = message(1, "NDARRAY", "", &array(frame));
            peer.write_all(&timed(message, time)).unwrap();
            thread::sleep(Duration::from_millis(10));
        }
        peer
    });
    let totals = totals(&output);
    assert_all(&seen, &totals);
    assert_eq!(totals["source"]["without_time"], 0, "{totals}");
    let (prompt, late) = seen.ages.split_at(LATE);
    assert!(prompt.iter().any(|&age| age < 100), "{prompt:?}");
    // On a loaded computer the first ones may have been late, too.
    assert!(late.iter().all(|&age| age >= 400), "{late:?}");
}

/// Positions of an organ at rest are new by another time in their header alone.
#[test]
fn an_organ_at_rest_stays_fresh_and_a_repeated_message_grows_old() {
    const MEASURED: usize = FRAMES / 2;
    const PAUSE: Duration = Duration::from_millis(20);
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let motion = folder.join("heart.pc2");
    let mut still = Motion::read_pc2(&motion).unwrap();
    still.frames.fill(frames[0].clone());
    still.write_pc2(&motion).unwrap();
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("--from igtl:{}", server.local_addr().unwrap());
    let (seen, _, _) = bridged(folder, &line, || {
        let mut peer = accepted(&server);
        let start = Instant::now();
        let mut time = 0.0;
        for number in 0..FRAMES {
            if number < MEASURED {
                time = 1000.0 + start.elapsed().as_secs_f64();
            }
            peer.write_all(&timed(message(1, "NDARRAY", "", &array(&frames[0])), time)).unwrap();
            thread::sleep(PAUSE);
        }
        peer
    });
    let pause = PAUSE.as_millis() as u32;
    let (measured, repeated) = seen.ages.split_at(MEASURED);
    // A loaded computer may hold some up.
    assert!(measured[MEASURED / 2..].iter().any(|&age| age < 2 * pause), "{measured:?}");
    let least = (1..).map(|step: u32| step * pause);
    assert!(repeated.iter().zip(least).all(|(&age, least)| age + 1 >= least), "{repeated:?}");
}

/// Where the user gives a rate, a frame that waits for its turn grows old meanwhile.
#[test]
fn frames_that_wait_grow_old() {
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = server.local_addr().unwrap();
    let line = format!("--from igtl:{at} --motion-rate 20 --frames {FRAMES}");
    let (seen, output, _) = bridged_to(folder, &line, Duration::MAX, || {
        let mut peer = accepted(&server);
        for frame in &frames {
            peer.write_all(&message(1, "NDARRAY", "", &array(frame))).unwrap();
        }
        peer
    });
    assert_all(&seen, &totals(&output));
    // Each came when the one before it was taken; a tick that is late makes the next one's wait shorter.
    let waited = &seen.ages[2..];
    assert!(waited.iter().sum::<u32>() >= 40 * waited.len() as u32, "{waited:?}");
}

/// How a message's part follows the one before it.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    /// Another one, measured now.
    New,
    /// The same, measured anew.
    Anew,
    /// The same message once more.
    Repeated,
    /// No message.
    Absent,
}

/// A frame with a pose is as old as the older of its positions and its pose. Positions of a frozen image stay old beside poses
/// that are new, and so does a frozen pose beside new positions; what is measured anew is new even if nothing moves.
#[test]
fn a_posed_frame_is_as_old_as_its_older_part() {
    use Part::{Absent, Anew, New, Repeated};
    const STEPS: usize = 10;
    const PHASES: [([Part; 2], bool); 5] = [
        ([New, Absent], true),
        ([Repeated, New], true),
        ([Anew, New], false),
        ([New, Repeated], true),
        ([New, Anew], false),
    ];
    const PAUSE: Duration = Duration::from_millis(40);
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let count = 1 + STEPS * PHASES.len();
    let (found, output) = posed(folder, &format!("--frames {count}"), |mut peer| {
        let start = Instant::now();
        let (mut numbers, mut times) = ([0, 0], [0.0; 2]);
        let steps = PHASES.iter().flat_map(|(parts, _)| [*parts; STEPS]);
        for parts in [[New, New]].into_iter().chain(steps) {
            for which in [1, 0] {
                let part = parts[which];
                numbers[which] += usize::from(part == New);
                if matches!(part, New | Anew) {
                    times[which] = 1000.0 + start.elapsed().as_secs_f64();
                }
                let message = match which {
                    0 => message(1, "NDARRAY", "heart", &array(&frames[numbers[0] % FRAMES])),
                    _ => {
                        let shift = Vec3::X * numbers[1] as f32;
                        pose_message("TRANSFORM", "organ", Quat::IDENTITY, shift)
                    }
                };
                if part != Absent {
                    peer.write_all(&timed(message, times[which])).unwrap();
                }
            }
            thread::sleep(PAUSE);
        }
        peer
    });
    assert_eq!(totals(&output)["frames"], count);
    let ages: Vec<u32> = found.iter().map(|frame| frame.age_ms.into()).collect();
    assert_eq!(ages.len(), count);
    for (phase, (ages, (_, is_old))) in ages[1..].chunks(STEPS).zip(PHASES).enumerate() {
        let pause = PAUSE.as_millis() as u32;
        let least = (1..).map(|step: u32| step * pause);
        if is_old {
            // Ages count from the quickest message so far, which a loaded computer may hold up, too.
            let grows = ages.iter().zip(least).all(|(&age, least)| age + pause / 2 >= least);
            assert!(grows, "phase {phase}: {ages:?}");
        } else {
            // A loaded computer may hold some up.
            let is_new = ages.iter().zip(least).any(|(&age, least)| age < least.min(2 * pause));
            assert!(is_new, "phase {phase}: {ages:?}");
        }
    }
}
