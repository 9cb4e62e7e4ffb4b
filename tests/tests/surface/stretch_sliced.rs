//! The stretch check in slices has the same result as a measurement of the whole frame.

// Requirement: F-02

use dibs_build::{Builder, Paths, generate};
use dibs_nostd::{
    Admission, AdmissionCheck, FrameExtent, IncomingSurface, MeasuredStretch, Millis, PathKind,
    REGIONS, StretchError, StretchMonitor, SurfaceLimits, Tree, VertexTable, measure_stretch,
};
use dibs_tests::deform::{Deformation, deformed, unit};
use fastrand::Rng;
use glam::Vec3;

/// Passes a frame to an admission check as a bus does: packets of rows in some order, and slices of work between them.
fn feed<V: VertexTable + ?Sized>(
    admission_check: &mut impl AdmissionCheck,
    surface: &V,
    changed: FrameExtent,
    packets: &[std::ops::Range<u32>],
    rng: &mut Rng,
) -> Result<MeasuredStretch, StretchError> {
    let rows = surface.len() as u32;
    let mut come = vec![changed == FrameExtent::Partial; rows as usize];
    packets.iter().cloned().flatten().for_each(|row| come[row as usize] = false);
    admission_check.begin(changed);
    let most = 1 + rng.u32(..400);
    let (mut ready, mut calls) = (0, 0);
    let mut order: Vec<_> = packets.to_vec();
    if rng.bool() {
        rng.shuffle(&mut order);
    }
    let mut order = order.into_iter();
    loop {
        let packet = order.next();
        let is_last = packet.is_none();
        for row in packet.clone().into_iter().flatten() {
            come[row as usize] = true;
        }
        packet.into_iter().for_each(|rows| admission_check.moved(rows));
        while ready < rows && come[ready as usize] {
            ready += 1;
        }
        let ready =
            if changed == FrameExtent::Partial && !is_last { ready.min(rows - 1) } else { ready };
        calls += 1;
        assert!(calls < 10_000, "the admission check does not come to an end");
        match admission_check.advance(IncomingSurface::new(surface, ready), rng.u32(..=most))? {
            Admission::Pending => (),
            Admission::Admitted(measured) => {
                assert!(ready == rows, "admitted before it was complete");
                return Ok(measured.expect("a monitor measures"));
            }
        }
    }
}

fn in_packets(rows: u32, each: usize) -> Vec<std::ops::Range<u32>> {
    (0..rows).step_by(each).map(|first| first..rows.min(first + each as u32)).collect()
}

/// Compares the results of a monitor that has measured earlier frames with a complete measurement: they are equal
/// except for the added rounding.
fn assert_same(
    sliced: Result<MeasuredStretch, StretchError>,
    whole: Result<MeasuredStretch, StretchError>,
) {
    let (Ok(sliced), Ok(whole)) = (sliced, whole) else {
        return assert_eq!(sliced, whole);
    };
    let (sigma, exact) = (sliced.sigma(), whole.sigma());
    assert!((sigma / exact - 1.0).abs() < 2e-5, "{sigma} for {exact}");
    // A region's stretch is stored in 256ths of the whole.
    for (region, exact) in sliced.regions().into_iter().zip(whole.regions()) {
        assert!((region - exact).abs() < sigma * 1.01 / 256.0, "{region} for {exact}");
    }
}

#[test]
fn sliced_is_whole_whatever_the_slices_and_the_packets() {
    let (_, built, frames) = deformed(90, 24);
    let tree = built.tree::<u16>().expect("valid");
    let mut monitor = StretchMonitor::new(&tree)
        .expect("a metric")
        .limits(SurfaceLimits::reach_mm(1e3).shrinkage(0.0));
    let mut rng = Rng::with_seed(25);
    for (round, moved) in frames.iter().enumerate() {
        let mut rows = built.to_rows(moved);
        let packets = in_packets(tree.vertex_count(), [1, 3, 7, 40][round % 4]);
        if round % 3 == 2 {
            // Every third frame is beyond the limit at one vertex.
            let at = rng.usize(..rows.len());
            rows[at] += unit(&mut rng) * 30.0;
        }
        let whole = measure_stretch(&tree, rows.as_slice());
        let sliced = feed(&mut monitor, rows.as_slice(), FrameExtent::Whole, &packets, &mut rng);
        assert_same(sliced, whole);
        assert_eq!(whole.is_err(), round % 3 == 2);
        let mut new = StretchMonitor::new(&tree)
            .expect("a metric")
            .limits(SurfaceLimits::reach_mm(1e3).shrinkage(0.0));
        assert_eq!(feed(&mut new, rows.as_slice(), FrameExtent::Whole, &packets, &mut rng), whole);
    }
}

#[test]
fn partial_is_whole_and_measures_only_what_moved() {
    let (mesh, built, _) = deformed(0, 0);
    let tree = built.tree::<u16>().expect("valid");
    let mut monitor = StretchMonitor::new(&tree)
        .expect("a metric")
        .limits(SurfaceLimits::reach_mm(1e3).shrinkage(0.0));
    let mut rng = Rng::with_seed(26);
    let mut surface = built.to_rows(&mesh.positions);
    let vertices = tree.vertex_count();
    // Before the first publication a partial frame is measured completely.
    let first =
        feed(&mut monitor, surface.as_slice(), FrameExtent::Partial, &in_packets(1, 1), &mut rng);
    assert_eq!(first, measure_stretch(&tree, surface.as_slice()));
    monitor.published();
    let (mut refused, mut abandoned) = (0, 0);
    for _ in 0..400 {
        let mut next = surface.clone();
        let first = rng.u32(..vertices);
        let moved = first..vertices.min(first + 1 + rng.u32(..60));
        let push = unit(&mut rng) * rng.f32() * 1.2;
        moved.clone().for_each(|row| next[row as usize] += push);
        let whole = measure_stretch(&tree, next.as_slice());
        let packets: Vec<_> = moved.clone().map(|row| row..row + 1).collect();
        if rng.u32(..5) == 0 {
            // An abandoned frame.
            monitor.begin(FrameExtent::Partial);
            monitor.moved(moved);
            let _ = monitor.advance(IncomingSurface::new(next.as_slice(), vertices), 20);
            abandoned += 1;
            continue;
        }
        let partial = feed(&mut monitor, next.as_slice(), FrameExtent::Partial, &packets, &mut rng);
        assert_same(partial, whole);
        match partial {
            Ok(_) => {
                monitor.published();
                surface = next;
            }
            Err(_) => refused += 1,
        }
    }
    assert!(refused > 10 && abandoned > 10, "{refused} refused, {abandoned} abandoned");

    // If one vertex changes, only the triangles of its regions are measured.
    monitor.begin(FrameExtent::Partial);
    monitor.moved(7..8);
    let mut work = 0;
    while monitor.advance(IncomingSurface::new(surface.as_slice(), vertices), 1)
        == Ok(Admission::Pending)
    {
        work += 1;
    }
    assert!(work > 0 && work < tree.triangle_count() / 4, "{work} triangles for one vertex");

    // If none changes, there is nothing to measure.
    monitor.published();
    monitor.begin(FrameExtent::Partial);
    monitor.moved(7..7);
    let admission = monitor.advance(IncomingSurface::new(surface.as_slice(), vertices), 0);
    assert!(matches!(admission, Ok(Admission::Admitted(Some(_)))), "{admission:?}");
}

/// A frame of a tree with paths along edges starts each region with the worst triangle of the last frame, and has the
/// result of a measurement of its own.
#[test]
fn paths_along_edges_are_measured_alike_in_slices() {
    let mesh = generate::heart(2_000).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).paths(Paths::Edges).build(&mesh);
    let built = built.expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    assert_eq!(tree.paths(), PathKind::EdgePath);
    let mut monitor = StretchMonitor::new(&tree)
        .expect("a metric")
        .limits(SurfaceLimits::reach_mm(1e3).shrinkage(0.0));
    let mut rng = Rng::with_seed(27);
    let packets = in_packets(tree.vertex_count(), 7);
    let kinds = [Deformation::Waves, Deformation::Bump, Deformation::Noise, Deformation::Rigid];
    for round in 0..40 {
        let moved = kinds[round % kinds.len()].apply(&mesh, tree.paths(), 1.4, &mut rng);
        let rows = built.to_rows(&moved);
        let whole = measure_stretch(&tree, rows.as_slice());
        assert!(whole.is_ok(), "{whole:?}");
        let sliced = feed(&mut monitor, rows.as_slice(), FrameExtent::Whole, &packets, &mut rng);
        assert_same(sliced, whole);
    }
}

/// An admission check that is given the published frame compares the rows itself, in slices of any size and as far as
/// they have arrived: it names the vertex that moved too far, and admits a frame without one.
#[test]
fn rows_are_compared_in_slices_of_any_size() {
    let (mesh, built, _) = deformed(0, 0);
    let tree = built.tree::<u16>().expect("valid");
    let rest = built.to_rows(&mesh.positions);
    let vertices = tree.vertex_count();
    // 1 mm in 9 ms and the one that counts because of rounding.
    let limits = SurfaceLimits::reach_mm(1e3).shrinkage(0.0).speed(0.1);
    for work in [1, 7, 40, 100_000] {
        for each in [11, vertices] {
            for fast in [None, Some(0), Some(500), Some(vertices - 1)] {
                let mut moved: Vec<Vec3> = rest.iter().map(|at| *at + Vec3::X * 0.5).collect();
                if let Some(vertex) = fast {
                    moved[vertex as usize].x += 1.0;
                }
                let mut monitor = StretchMonitor::new(&tree).expect("a metric").limits(limits);
                monitor.begin(FrameExtent::Whole);
                let (mut ready, mut calls) = (0, 0);
                let outcome = loop {
                    ready = vertices.min(ready + each);
                    calls += 1;
                    assert!(calls < 10_000, "the admission check does not come to an end");
                    let before = Some((rest.as_slice(), Millis(9)));
                    let incoming = IncomingSurface::new(moved.as_slice(), ready);
                    match monitor.advance(IncomingSurface { before, ..incoming }, work) {
                        Ok(Admission::Pending) => (),
                        outcome => break outcome,
                    }
                };
                match (fast, outcome) {
                    (None, Ok(Admission::Admitted(Some(_)))) => {
                        // One row or triangle a call.
                        let all = vertices + tree.triangle_count();
                        assert!(work > 1 || each < vertices || calls == all, "{calls} {all}");
                    }
                    (Some(fast), Err(StretchError::TooFast { vertex, step, limit })) => {
                        assert_eq!((vertex, limit), (fast, 1.0));
                        assert!((step - 1.5).abs() < 1e-4, "{step}");
                    }
                    other => panic!("{other:?} with work {work}, {each} rows a call"),
                }
            }
        }
    }
}

/// No call exceeds its work. With work for one triangle a call, a frame takes as many calls as it has triangles; from
/// the second frame on, each region takes one more, for its last worst triangle.
#[test]
fn a_slice_is_no_longer_than_it_may_be() {
    let (mesh, built, _) = deformed(0, 0);
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut monitor = StretchMonitor::new(&tree)
        .expect("a metric")
        .limits(SurfaceLimits::reach_mm(1e3).shrinkage(0.0));
    for again in [0, REGIONS as u32] {
        monitor.begin(FrameExtent::Whole);
        let mut calls = 1;
        while monitor.advance(IncomingSurface::new(rows.as_slice(), tree.vertex_count()), 1)
            == Ok(Admission::Pending)
        {
            calls += 1;
        }
        assert_eq!(calls, tree.triangle_count() + again);
        assert!(calls <= monitor.whole_work());
    }
}

/// The tree's bytes may be at any address: unaligned, they give the same measurement.
#[test]
fn an_odd_address_changes_nothing() {
    let (_, built, frames) = deformed(9, 29);
    let aligned = built.tree::<u16>().expect("valid");
    let mut room = vec![0; built.blob().len() + 4];
    for at in 0..4 {
        room[at..][..built.blob().len()].copy_from_slice(built.blob());
        let tree = Tree::<u16>::from_bytes(&room[at..][..built.blob().len()]).expect("valid");
        for moved in &frames {
            let rows = built.to_rows(moved);
            let measured = measure_stretch(&tree, rows.as_slice());
            assert_eq!(measured, measure_stretch(&aligned, rows.as_slice()));
        }
    }
}
