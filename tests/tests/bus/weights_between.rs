//! The surface between frames of weights, and its extrapolation beyond the last one.

// Requirements: F-05, F-06

use dibs_build::Builder;
use dibs_build::glam::DVec3;
use dibs_build::modes::ModalFit;
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::glam::Vec3;
use dibs_nostd::modes::{ModalAdmissionCheck, ModalFrame, ModalReader, Modes};
use dibs_nostd::wire::{FrameId, WeightsEncoder};
use dibs_nostd::{
    Admission, AdmissionCheck, Advance, Assembler, Fallback, FrameExtent, FrameLabel, FrameWriter,
    Frames, IncomingSurface, Millis, MovingSurface, NoAdmissionCheck, Options, Query, Sphere,
    StretchError, Tracker, Tree, VertexTable, measure_stretch,
};
use dibs_tests::deform::unit;
use dibs_tests::modal::{anywhere, positions};
use dibs_tests::motions::trembling;
use fastrand::Rng;

const MODES: usize = 4;

type Bus<G> = Assembler<'static, G>;
type Reader = ModalReader<'static, 'static, MODES>;

fn surface() -> &'static Tree<'static, u16> {
    let (mesh, motion) = trembling(320, 3, 6);
    let fit = ModalFit::new(&mesh, &motion).expect("a motion");
    let rest = Builder::new().stretch(1.25).build(&mesh).expect("a valid mesh");
    let built = rest.with_modes(&fit, MODES).expect("so many");
    let tree = Tree::from_bytes(built.blob().to_vec().leak()).expect("valid");
    Box::leak(Box::new(tree))
}

fn buffers(modes: &Modes<'static>) -> (FrameWriter<'static>, Reader) {
    let frames: &'static Frames<MODES> = Box::leak(Box::new(Frames::new()));
    let (writer, reader) = frames.split().expect("once");
    (writer, ModalReader::new(reader, modes).expect("four modes"))
}

/// Sends a frame; true if it was published.
fn send<G: AdmissionCheck>(
    bus: &mut Bus<G>,
    mesh_id: u32,
    epoch: u32,
    weights: &[f32],
    now: u32,
) -> bool {
    let id = FrameId { mesh_id, session: 1, epoch };
    let mut encoder = WeightsEncoder::<64>::new(id, weights).expect("can be sent");
    let (mut buffer, mut outcome) = ([0; 64], Ok(Advance::Idle));
    while let (Some(packet), Ok(_)) = (encoder.next_packet(&mut buffer), &outcome) {
        let accepted = bus.accept(packet, Millis(now));
        outcome = accepted.and_then(|_| bus.advance(u32::MAX));
    }
    outcome == Ok(Advance::Published { epoch })
}

/// The rows of the surface at these weights, in f64.
fn exact(modes: &Modes<'_>, weights: &[f64]) -> Vec<DVec3> {
    let of = |row| {
        let rest = modes.rest_position(row).expect("in the table").as_dvec3();
        weights.iter().enumerate().fold(rest, |sum, (mode, weight)| {
            let steps = modes.displacement(mode, row).expect("there").map(f64::from);
            let step = f64::from(modes.step(mode).expect("there"));
            sum + DVec3::from(steps) * step * *weight
        })
    };
    (0..modes.vertex_count()).map(of).collect()
}

fn off(surface: &impl VertexTable, rows: &[DVec3]) -> f64 {
    let found = positions(surface);
    found.iter().zip(rows).map(|(a, b)| a.as_dvec3().distance(*b)).fold(0.0, f64::max)
}

/// Weights at a fraction of the interval from one frame to another.
fn blend(from: &[f32], to: &[f32], share: f64) -> Vec<f64> {
    let of = |(from, to): (&f32, &f32)| {
        let (from, to) = (f64::from(*from), f64::from(*to));
        from + (to - from) * share
    };
    from.iter().zip(to).map(of).collect()
}

/// The end of the extrapolation from the second of two frames: two more intervals, within the modes' ranges.
fn end(modes: &Modes<'_>, [from, to]: [&[f32]; 2]) -> Vec<f32> {
    let far = blend(from, to, 3.0);
    let within = |(mode, weight)| {
        let [low, high] = modes.range(mode).expect("there");
        f64::clamp(weight, f64::from(low), f64::from(high)) as f32
    };
    far.into_iter().enumerate().map(within).collect()
}

/// A frame that was read: its time and weights.
type Known = (u32, Vec<f32>);

/// Frames of a random motion, some of them refused, and some replaced before they are read. At every tick the held, the
/// interpolated and the extrapolated surface follow from two frames, no triangle is stretched more than they state, and
/// the tracker's answer equals that of a whole query.
#[test]
fn the_surface_between_frames_of_weights_is_where_they_put_it() {
    let mut rng = Rng::with_seed(31);
    let tree = surface();
    let modes = Modes::of(tree).expect("valid");
    let (writer, mut reader) = buffers(&modes);
    let admission_check = ModalAdmissionCheck::<_, MODES>::new(&modes, tree).expect("four modes");
    let mut bus = Assembler::new(writer, admission_check, tree.mesh_id(), 1e4);
    let mut query = Query::<u16, MAX_STACK>::new(tree).expect("deep enough");
    let mut trackers = [(); 3].map(|()| Tracker::<u16, MAX_STACK, 96>::new(tree).expect("deep"));
    let (mut known, mut now, mut tool) =
        (Vec::<Known>::new(), 7_u32.wrapping_neg(), Vec3::X * 90.0);
    let [mut moving, mut held, mut refused, mut kept, mut told] = [0; 5];
    let mut errors = [f64::NAN; 2];
    let mut loosest = [0.0_f64; 2];
    let mut target = anywhere(&modes, &mut rng);
    let mut weights = vec![0.0_f32; MODES];
    for epoch in 1..500 {
        if epoch % 12 == 0 {
            target = anywhere(&modes, &mut rng);
        }
        for (weight, target) in weights.iter_mut().zip(&target) {
            *weight += (target - *weight) * 0.12;
        }
        let is_published = send(&mut bus, tree.mesh_id(), epoch, &weights, now);
        refused += u32::from(!is_published);
        let is_read = rng.u32(..8) > 0;
        if is_published && is_read {
            let expected = match known.as_slice() {
                [.., (t0, a), (t1, b)] => {
                    let share = f64::from(now.wrapping_sub(*t1)) / f64::from(t1.wrapping_sub(*t0));
                    let end = end(&modes, [a, b]);
                    let predicted = exact(&modes, &blend(b, &end, share.min(2.0) / 2.0));
                    let frame =
                        exact(&modes, &weights.iter().map(|w| f64::from(*w)).collect::<Vec<_>>());
                    let growth = (2.0 * share / (1.0 + share)).max(1.0);
                    let off = predicted.iter().zip(&frame).map(|(a, b)| a.distance(*b));
                    off.fold(0.0, f64::max) * growth
                }
                _ => f64::NAN,
            };
            errors = [errors[1], expected];
            known.push((now, weights.clone()));
        }
        for tick in 0..rng.u32(4..40) {
            now = now.wrapping_add(1);
            if tick % 3 != 0 || !(is_read && is_published) {
                continue;
            }
            tool += unit(&mut rng) * 0.3;
            let tool = Sphere::new(tool, 2.0).expect("valid");
            let frame = reader.latest(Millis(now)).of_any_age().expect("published");
            let (received, last) = known.last().expect("read");
            let age = f64::from(now.wrapping_sub(*received));
            let surfaces = [frame, frame.interpolated(), frame.extrapolated()];
            for (number, (surface, tracker)) in surfaces.iter().zip(&mut trackers).enumerate() {
                let held_at = exact(&modes, &blend(last, last, 0.0));
                let place = match known.as_slice() {
                    [.., (earlier, before), _] if number > 0 => {
                        let share = age / f64::from(received.wrapping_sub(*earlier));
                        match number {
                            1 => blend(before, last, share.min(1.0)),
                            _ => blend(last, &end(&modes, [before, last]), share.min(2.0) / 2.0),
                        }
                    }
                    _ => blend(last, last, 0.0),
                };
                let away = off(surface, &exact(&modes, &place));
                // Only an extrapolation may be held.
                if away < 1e-4 {
                    moving += 1;
                } else {
                    assert!(
                        number == 2 && off(surface, &held_at) < 1e-4,
                        "{epoch}, {number}: {away}"
                    );
                    held += 1;
                }
                // A query identifies a frame by its number.
                let is_frame = off(surface, &held_at) < 1e-4;
                assert!(surface.epoch().is_none() || is_frame, "{epoch}, {number}");
                let truth = measure_stretch(tree, surface).expect("within the limit").sigma();
                let stated = surface.stretch().expect("bounded").sigma();
                assert!(stated >= truth * 0.9999, "{epoch}, {number}: {stated} for {truth}");
                loosest[0] = loosest[0].max(f64::from(stated - truth));
                let options = Options::cold().unsigned();
                let whole = query.closest(surface, &tool, &options).expect("an answer");
                let found = tracker.closest(surface, &tool, &options).expect("an answer");
                let apart = (found.closest.separation - whole.separation).abs();
                assert!(apart <= found.closest.accuracy + whole.accuracy, "{epoch}: {found:?}");
                kept += u32::from(found.fallback.is_none());
            }
            // Behind the present by its age; between frames by a whole interval; beyond the last frame not at all, up
            // to two intervals.
            let age = now.wrapping_sub(*received);
            let interval = match known.as_slice() {
                [.., (earlier, _), _] => received.wrapping_sub(*earlier),
                _ => 0,
            };
            let is_ahead = surfaces[2].residual().is_some();
            let beyond = if is_ahead { age.saturating_sub(2 * interval) } else { age };
            let behind = [age, age.max(interval), beyond].map(|lag| Some(Millis(lag)));
            assert_eq!(surfaces.map(|surface| surface.lag()), behind, "{epoch}");
            if let Some(shown) = surfaces[2].residual() {
                let exact = errors[0].max(errors[1]);
                let shown = f64::from(shown);
                assert!(shown >= exact - 1e-4, "{epoch}: {shown} for {exact}");
                loosest[1] = loosest[1].max(shown - 4.0 * exact);
                told += 1;
            }
            assert!(surfaces[..2].iter().all(|surface| surface.residual().is_none()));
        }
    }
    println!(
        "{moving} moving, {held} held, {refused} refused, {told} errors told, {kept} by the front, {loosest:?} loosest"
    );
    assert!(moving > 2_000 && held > 50 && refused > 5 && told > 500 && kept > 2_000);
    assert!(loosest[0] < 1.0 && loosest[1] < 0.1, "the bounds are loose: {loosest:?}");
}

fn label(epoch: u32, received: u32) -> FrameLabel {
    let received = Millis(received);
    FrameLabel { epoch, received, position_error: 0.0, stretch: None }
}

/// Publishes weights without a receiver.
fn publish(writer: &mut FrameWriter<'static>, weights: &[f32], label: FrameLabel) {
    writer.begin();
    for weight in weights {
        writer.push(Vec3::new(*weight, 0.0, 0.0)).expect("in the table");
    }
    writer.publish(label).expect("complete");
}

/// Weights out of their ranges, which no receiver publishes: their motion is unknown, and so is that to the next frame.
#[test]
fn weights_out_of_range_have_no_motion() {
    let mut rng = Rng::with_seed(32);
    let tree = surface();
    let modes = Modes::of(tree).expect("valid");
    let (mut writer, mut reader) = buffers(&modes);
    let mut tracker = Tracker::<u16, MAX_STACK, 96>::new(tree).expect("deep");
    let tool = Sphere::new(Vec3::X * 90.0, 2.0).expect("valid");
    let good = anywhere(&modes, &mut rng);
    for hostile in [f32::NAN, f32::INFINITY, 1e30, -1e30] {
        let mut bad = good.clone();
        bad[2] = hostile;
        tracker.forget();
        let frames = [
            (&good, Some(Fallback::Start)),
            (&good, None),
            (&bad, Some(Fallback::Surface)),
            (&good, Some(Fallback::Start)),
            (&good, None),
        ];
        for (epoch, (weights, expected)) in (0..).zip(frames) {
            publish(&mut writer, weights, label(epoch, 20 * epoch));
            let frame = reader.latest(Millis(20 * epoch + 10)).of_any_age().expect("published");
            for surface in [frame, frame.interpolated(), frame.extrapolated()] {
                assert_eq!(surface.motion().is_some(), !std::ptr::eq(weights, &raw const bad));
            }
            let found = tracker.closest(&frame, &tool, &Options::cold().unsigned()).expect("sound");
            assert_eq!(found.fallback, expected, "{epoch}: {hostile}");
        }
    }
}

/// Two frames with the same label are different frames: the second has its own slot, and its motion is measured.
#[test]
fn frames_of_one_label_are_told_apart() {
    let mut rng = Rng::with_seed(35);
    let tree = surface();
    let modes = Modes::of(tree).expect("valid");
    let (mut writer, mut reader) = buffers(&modes);
    let mut tracker = Tracker::<u16, MAX_STACK, 96>::new(tree).expect("deep");
    let mut whole = Query::<u16, MAX_STACK>::new(tree).expect("deep");
    let options = Options::cold().unsigned();
    for _ in 0..50 {
        let weights = anywhere(&modes, &mut rng);
        publish(&mut writer, &weights, label(7, 20));
        let frame = reader.latest(Millis(30)).of_any_age().expect("published");
        let exact =
            exact(&modes, &weights.iter().map(|weight| f64::from(*weight)).collect::<Vec<_>>());
        assert!(off(&frame, &exact) < 1e-2);
        let tool = Sphere::new(exact[0].as_vec3() * 1.1, 2.0).expect("valid");
        let found = tracker.closest(&frame, &tool, &options).expect("sound").closest;
        let truth = whole.closest(&frame, &tool, &options).expect("sound");
        assert!((found.separation - truth.separation).abs() <= 2.0 * truth.accuracy);
    }
}

/// Two frames of the same time define no velocity, and a frame read without a time is not extrapolated.
#[test]
fn without_a_time_between_frames_nothing_moves() {
    let mut rng = Rng::with_seed(33);
    let tree = surface();
    let modes = Modes::of(tree).expect("valid");
    let (writer, mut reader) = buffers(&modes);
    let mut bus = Assembler::new(writer, WithinRange(&modes), tree.mesh_id(), 1e4);
    let same = |frame: &ModalFrame<'_, MODES>, moved: ModalFrame<'_, MODES>| {
        positions(frame) == positions(&moved) && moved.residual().is_none()
    };
    // The surface is extrapolated once a third frame has shown the residual.
    let frames = [(20, [true; 2]), (40, [false, true]), (40, [true; 2]), (60, [false, true])];
    let frames = frames.into_iter().chain([(80, [false; 2])]);
    for (epoch, (now, is_held)) in (1..).zip(frames) {
        let weights: Vec<f32> =
            anywhere(&modes, &mut rng).iter().map(|weight| weight * 0.02).collect();
        assert!(send(&mut bus, tree.mesh_id(), epoch, &weights, now));
        let frame = reader.latest(Millis(now + 5)).of_any_age().expect("published");
        let found = [frame.interpolated(), frame.extrapolated()].map(|moved| same(&frame, moved));
        assert_eq!(found, is_held, "{epoch}");
        let frame = reader.read().expect("published");
        assert!(same(&frame, frame.extrapolated()) || epoch == 5, "{epoch}");
    }
}

/// No extrapolated weight leaves its range.
#[test]
fn an_extrapolation_ends_at_the_ends_of_the_ranges() {
    let tree = surface();
    let modes = Modes::of(tree).expect("valid");
    let mut ended = 0;
    for (mode, end) in (0..MODES).flat_map(|mode| [(mode, 0), (mode, 1)]) {
        let (writer, mut reader) = buffers(&modes);
        let mut bus = Assembler::new(writer, WithinRange(&modes), tree.mesh_id(), 1e4);
        let at = |share: f32| {
            let mut weights = [0.0; MODES];
            weights[mode] = modes.range(mode).expect("there")[end] * share;
            weights
        };
        assert!(send(&mut bus, tree.mesh_id(), 1, &at(0.2), 20));
        assert!(reader.read().is_some());
        assert!(send(&mut bus, tree.mesh_id(), 2, &at(0.45), 40));
        assert!(reader.read().is_some());
        assert!(send(&mut bus, tree.mesh_id(), 3, &at(0.7), 60));
        let frame = reader.latest(Millis(100)).of_any_age().expect("published");
        let moved = frame.extrapolated();
        if moved.epoch().is_none() {
            let last = at(1.0).map(f64::from);
            assert!(off(&moved, &exact(&modes, &last)) < 1e-4, "{mode}");
            ended += 1;
        }
    }
    assert!(ended > 2, "{ended}");
}

/// An admission check that bounds no stretch.
struct WithinRange<'a>(&'a Modes<'a>);

impl AdmissionCheck for WithinRange<'_> {
    fn begin(&mut self, changed: FrameExtent) {
        NoAdmissionCheck.begin(changed);
    }

    fn weight_range(&self, mode: u32) -> Option<[f32; 2]> {
        self.0.range(mode as usize)
    }

    fn advance<V: VertexTable + ?Sized>(
        &mut self,
        arriving: IncomingSurface<'_, V>,
        work: u32,
    ) -> Result<Admission, StretchError> {
        NoAdmissionCheck.advance(arriving, work)
    }
}
