//! Sends any bytes to a guard whose frames may have a pose. Every packet is taken or refused, and every answer is finite. The
//! input is a sequence of packets, each after its length; packets of odd length get a right checksum.
#![no_main]

use std::sync::LazyLock;

use dibs_build::{Builder, BuiltTree, generate};
use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::{Bus, Guard, GuardLimits, PosedRows, Surface};
use dibs_nostd::wire::NoMac;
use dibs_nostd::{Advance, Millis, Sphere, TreeBytes, VertexTable};
use dibs_tests::bus::reseal;
use libfuzzer_sys::fuzz_target;

static TREE: LazyLock<BuiltTree> = LazyLock::new(|| {
    let heart = generate::heart(320).expect("a valid size").mesh;
    Builder::new().stretch(1.5).build(&heart).expect("a tree")
});

type Ends<'s> =
    (Bus<'s, 'static, u16, NoMac, PosedRows>, Guard<'s, 'static, u16, 64, 96, PosedRows>);

fuzz_target!(|input: &[u8]| {
    let surface: Surface<162, PosedRows> = Surface::new();
    let limits = GuardLimits::new(3_000.0, Millis(10_000)).automatic().without_transit();
    let tree = TreeBytes::<u16>::new(TREE.blob());
    let (mut bus, mut guard): Ends<'_> = surface.start(tree, limits).expect("a sound tree");
    let tool = Sphere::new(Vec3::new(90.0, 0.0, 30.0), 2.5).expect("a tool");
    let mut rest = input;
    let mut now = 0;
    while let Some((&length, after)) = rest.split_first() {
        let (packet, after) = after.split_at(after.len().min(usize::from(length)));
        rest = after;
        now += 10;
        let sealed = if length % 2 == 1 && packet.len() > 4 {
            reseal(packet.to_vec())
        } else {
            packet.to_vec()
        };
        // Any outcome is right, except a panic.
        let _ = bus.packet(&sealed, Millis(now));
        while let Ok(Advance::Pending) = bus.work(1_000) {}
        if let Some(frame) = bus.surface() {
            let rows = (0..162).map(|row| frame.position(row).expect("a published frame is whole"));
            assert!(rows.into_iter().all(Vec3::is_finite));
        }
        let answer = guard.closest(&tool, Millis(now + 3));
        if let Ok(tracked) = answer.tracked {
            let found = tracked.closest;
            assert!(found.separation.is_finite() && found.accuracy.is_finite());
            assert!(found.point_on_surface.is_finite() && answer.velocity.is_finite());
            assert!(found.lower <= found.separation);
        }
    }
});
