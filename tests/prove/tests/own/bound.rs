//! The path bound, on functions of a few instructions.

// Requirement: A-06

use std::collections::{BTreeMap, BTreeSet};
use std::env;

use dibs_prove::bound::cycles::cycles;
use dibs_prove::bound::decode::may_write;
use dibs_prove::bound::facts::{Count, Fact, Most};
use dibs_prove::bound::graph::Program;
use dibs_prove::bound::image::Image;
use dibs_prove::bound::lines::{Lines, Within};
use dibs_prove::bound::loops::loops;
use dibs_prove::bound::prices::least;
use dibs_prove::bound::system::{Part, Row, System, length};
use dibs_prove::bound::trace::Follower;
use dibs_prove::bound::walk::{Longest, UNIT, longest};
use xtask::workspace;

/// PUSH; MOVS; a loop of ADDS, CBZ over the second half of it, CMP and BNE; POP.
const SHORT: [u16; 8] = [0xB510, 0x2400, 0x3401, 0xB104, 0x42A0, 0xD1FB, 0xBD10, 0xBF00];
/// The same with two NOP that CBZ may pass over.
const LONG: [u16; 9] = [0xB510, 0x2400, 0x3401, 0xB10C, 0xBF00, 0xBF00, 0x42A0, 0xD1F9, 0xBD10];

const ONE_NODE: Most = Most { base: 0, roots: 0, nodes: 1, triangles: 0 };
const TYPICAL: Most = Most { base: 1, roots: 1, nodes: 100, triangles: 1 };

fn program(halves: &[u16]) -> Program {
    Program::read(&Image::of_halves(halves), 0, &BTreeSet::new()).expect("a program")
}

/// Each turn of the loop, which starts at the third instruction, is a node test.
fn counted(program: &Program) -> System {
    let blocks = &program.functions[&0].blocks;
    let turn = blocks.iter().position(|block| block.instructions[0] == 4).expect("a loop");
    let coefficients = BTreeMap::from([(Part::Block(0, turn), 1)]);
    let mut system = System::default();
    system.add(Row { name: "turns", coefficients, most: ONE_NODE });
    system
}

/// Base and node test, in instructions.
fn constants(halves: &[u16]) -> [f64; 2] {
    let program = program(halves);
    let system = counted(&program);
    let bound =
        least(&program, &system, &TYPICAL, &|_| 1, |at| format!("{at:#x}")).expect("a bound");
    let [base, _, node, _] = bound.constants(&system).map(|part| part as f64 / UNIT as f64);
    [base, node]
}

#[test]
fn a_longer_path_raises_the_bound_by_its_length() {
    let ([base, node], [longer_base, longer]) = (constants(&SHORT), constants(&LONG));
    assert!((base - 3.0).abs() < 0.02 && (node - 4.0).abs() < 0.02, "{base} {node}");
    assert!((longer_base - 3.0).abs() < 0.02, "{longer_base}");
    assert!((longer - 6.0).abs() < 0.02, "{longer}");
}

#[test]
fn a_loop_without_a_fact_is_named() {
    let program = program(&LONG);
    let found = least(&program, &System::default(), &TYPICAL, &|_| 1, |at| format!("here {at:#x}"));
    let error = found.err().expect("no bound").to_string();
    assert!(error.contains("no fact bounds the loop through here"), "{error}");
}

/// An instruction that the table lacks is an error, not cheap.
#[test]
fn an_instruction_has_the_latency_of_the_model() {
    for (text, latency) in [
        ("adds\tr0, r1, r2", 1),
        ("add.w\tr0, r1, r2, lsl #2", 2),
        ("vmulgt.f32\ts0, s1, s2", 3),
        ("vmla.f32\ts0, s1, s2", 6),
        ("vsqrt.f32\ts0, s1", 16),
        ("ldr.w\tr0, [r1, #4]", 2),
        ("ldrbne\tr0, [r1]", 3),
        ("ldrd\tr6, r4, [r1, #20]", 3),
        ("vldr\td0, [r3]", 3),
        ("umull\tr0, r1, r2, r3", 2),
        ("vpush\t{d8-d15}", 18),
        ("stmdb\tsp!, {r8, r9, fp}", 5),
        ("cbz\tr0, 1c4", 8),
        ("bhi.n\t1c4", 8),
        ("tbb\t[pc, r4]", 11),
        ("pop\t{r4, r5, r7, pc}", 13),
        ("ldrdeq\tr6, r4, [r1, #20]", 3),
        ("itte\tne", 1),
        ("ldr.w\tpc, [sp], #4", 11),
        ("uxtab\tr0, r1, r2", 2),
        ("uqadd16\tr0, r1, r2", 2),
        ("nop", 3),
    ] {
        assert_eq!(cycles(text).expect(text), latency, "{text}");
    }
    for unknown in ["vadd.f64\td0, d1, d2", "vdiv.f64\td0, d1, d2", "wfi"] {
        let error = cycles(unknown).expect_err(unknown).to_string();
        assert!(error.contains("no latency of"), "{error}");
    }
}

/// So that a wrong answer of the solver is no bound.
#[test]
fn the_check_refuses_prices_that_are_too_low() {
    let program = program(&LONG);
    let system = counted(&program);
    let at =
        |price: i128| longest(&program, &system, &[price], &|_| 1).expect("a program with an end");
    assert!(matches!(at(6 * UNIT - 1), Longest::Cycles(_)));
    let Longest::Walk(walk, gain) = at(6 * UNIT) else { panic!("the price is enough") };
    // One turn, which pays for itself.
    assert_eq!((walk.length, gain), (9, 3 * UNIT));
    assert!(longest(&program, &system, &[-1], &|_| 1).is_err());
}

/// A second NOP that takes five makes the loop's turn longer by four, and the first price of the bound with it.
#[test]
fn an_instruction_is_as_long_as_it_weighs() {
    let program = program(&LONG);
    let system = counted(&program);
    let weigh = |at: u32| if at == 8 { 5 } else { 1 };
    let at = |price: i128| longest(&program, &system, &[price], &weigh).expect("an end");
    assert!(matches!(at(10 * UNIT - 1), Longest::Cycles(_)));
    let Longest::Walk(walk, _) = at(10 * UNIT) else { panic!("the price is enough") };
    assert_eq!(walk.length, 13);
    let bound = least(&program, &system, &TYPICAL, &weigh, |at| format!("{at:#x}"));
    let [_, _, node, _] = bound.expect("a bound").constants(&system);
    assert!((node as f64 / UNIT as f64 - 10.0).abs() < 0.02, "{node}");
}

#[test]
fn a_branch_to_a_register_and_recursion_are_errors() {
    let read = |halves: &[u16]| Program::read(&Image::of_halves(halves), 0, &BTreeSet::new());
    // BX r3, MOV pc, r3 and TBB [r1, r0].
    for halves in [&[0x4718_u16][..], &[0x469F], &[0xE8D1, 0xF000]] {
        let error = read(halves).err().expect("no program").to_string();
        assert!(error.contains("leads to an address in a register"), "{error}");
    }
    // BL to itself.
    let error = read(&[0xF7FF, 0xFFFE, 0x4770]).err().expect("no program").to_string();
    assert!(error.contains("recursion"), "{error}");
}

/// A branch into the middle of a loop.
#[test]
fn a_loop_of_two_entries_is_an_error() {
    // CBZ to the second half of the loop; ADDS; ADDS; CMP; BNE to the first ADDS; BX lr.
    let program = program(&[0xB100, 0x3401, 0x3401, 0x42A0, 0xD1FB, 0x4770]);
    let function = &program.functions[&0];
    let error = loops(function).err().expect("no loops").to_string();
    assert!(error.contains("a loop with several entries"), "{error}");
}

#[test]
fn a_table_of_jumps_leads_to_each_of_its_places() {
    // TBB [pc, r0] with two bytes; BX lr; BX lr.
    let read = |table: u16| {
        let image = Image::of_halves(&[0xE8DF, 0xF000, table, 0x4770, 0x4770]).with_data(4..6);
        Program::read(&image, 0, &BTreeSet::new())
    };
    let program = read(0x0201).expect("a program");
    let blocks = program.functions[&0].blocks.iter().map(|block| block.instructions[0]);
    assert_eq!(blocks.collect::<Vec<_>>(), [0, 6, 8]);
    let error = read(0x7F01).err().expect("no program").to_string();
    assert!(error.contains("leads to 0x102"), "{error}");
}

#[test]
fn a_call_that_is_never_made_ends_its_path() {
    // CBZ to BX lr; BL to 8; BX lr; the function that is called.
    let image = Image::of_halves(&[0xB108, 0xF000, 0xF801, 0x4770, 0x4770]);
    let read = |never: &[u32]| Program::read(&image, 0, &never.iter().copied().collect());
    assert!(read(&[]).is_err(), "no function starts at 8");
    let program = read(&[2]).expect("a program");
    let Ok(Longest::Walk(walk, _)) = longest(&program, &System::default(), &[], &|_| 1) else {
        panic!("no loop")
    };
    assert_eq!(walk.length, 2);
}

#[test]
fn a_copied_length_is_a_constant_or_an_error() {
    let of = |halves: &[u16], places: &[u32]| length(&Image::of_halves(halves), places, 2);
    // MOVS r2; MOV.W r2; MOVW r2; then BL.
    assert_eq!(of(&[0x220C, 0xF7FF, 0xFFFE], &[0, 2]).expect("a constant"), 12);
    assert_eq!(of(&[0xF04F, 0x0210, 0xF7FF, 0xFFFE], &[0, 4]).expect("a constant"), 16);
    assert_eq!(of(&[0xF240, 0x2208, 0xF7FF, 0xFFFE], &[0, 4]).expect("a constant"), 0x208);
    // MOVW r2 with more than eleven bits.
    assert_eq!(of(&[0xF640, 0x12A4, 0xF7FF, 0xFFFE], &[0, 4]).expect("a constant"), 0x9A4);
    // The last one counts, another register does not, and IT of one instruction ends after it.
    let ended = [0xBF18, 0x2301, 0x220C, 0xF7FF, 0xFFFE];
    assert_eq!(of(&ended, &[0, 2, 4, 6]).expect("one"), 12);
    assert_eq!(of(&[0x2204, 0x220C, 0x2301, 0xF7FF, 0xFFFE], &[0, 2, 4, 6]).expect("one"), 12);
    // An IT block that does not write the register may follow.
    let before = [0x220C, 0xBF18, 0x2301, 0xF7FF, 0xFFFE];
    assert_eq!(of(&before, &[0, 2, 4, 6]).expect("one"), 12);
    // After IT of one, and of two instructions; changed by ADDS; loaded from memory; not in the block.
    for (halves, places) in [
        (&[0xBF18, 0x220C, 0xF7FF, 0xFFFE][..], &[0, 2, 4][..]),
        (&[0xBF1C, 0x2301, 0x220C, 0xF7FF, 0xFFFE], &[0, 2, 4, 6]),
        (&[0x220C, 0x3201, 0xF7FF, 0xFFFE], &[0, 2, 4]),
        (&[0x6802, 0xF7FF, 0xFFFE], &[0, 2]),
        (&[0xF7FF, 0xFFFE], &[0]),
    ] {
        let error = of(halves, places).expect_err("no constant").to_string();
        assert!(error.contains("is no constant"), "{error}");
    }
}

#[test]
fn a_return_under_a_condition_ends_the_function_or_not() {
    // PUSH; CMP; IT NE; POPNE; NOP; POP.
    let program = program(&[0xB510, 0x42A0, 0xBF18, 0xBD10, 0xBF00, 0xBD10]);
    let Ok(Longest::Walk(walk, _)) = longest(&program, &System::default(), &[], &|_| 1) else {
        panic!("no loop")
    };
    assert_eq!(walk.length, 6);
    let ends = program.functions[&0].edges.iter().filter(|edge| edge.to.is_none()).count();
    assert_eq!(ends, 2);
}

/// A line that is gone, and one whose code is not in the program.
#[test]
fn a_fact_that_matches_nothing_is_an_error() {
    const GONE: &[(i64, Count)] =
        &[(1, Count::Passes(&[Within::Line("Cargo.toml", "no such line")]))];
    const NOWHERE: &[(i64, Count)] = &[(1, Count::Heads(&[Within::Function("nothing")]))];
    let (image, program) = (Image::of_halves(&LONG), program(&LONG));
    let own = env::current_exe().expect("a program");
    let lines = Lines::read(&own, &workspace::root(), [].into_iter()).expect("symbols");
    for (terms, says) in [(GONE, "has no `no such line`"), (NOWHERE, "nothing in the program")] {
        let facts = [Fact { name: "wrong", terms, most: ONE_NODE, because: "" }];
        let found = System::new(&program, &image, &lines, facts.iter());
        let error = format!("{:#}", found.err().expect("no system"));
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn a_trace_that_leaves_the_graph_or_breaks_a_fact_is_found() {
    let program = program(&LONG);
    let system = counted(&program);
    let turn = [4, 6, 8, 10, 12, 14];
    let path = |turns: usize| [&[0, 2][..], &turn.repeat(turns), &[16]].concat();
    let mut follower = Follower::new(&program);
    for at in path(3) {
        follower.step(at).expect("on the graph");
    }
    let runs = follower.runs();
    let [run] = &runs[..] else { panic!("one run") };
    assert_eq!((run.instructions, run.left(&system.rows[0])), (21, 3));
    // The second half of the loop without the first.
    let mut follower = Follower::new(&program);
    let left: Result<(), _> = [0, 2, 4, 12].into_iter().try_for_each(|at| follower.step(at));
    assert!(left.is_err());
}

#[test]
fn what_may_write_a_register_is_found() {
    // ADDS r2, #1; LDR r2, [r0]; POP {r2, pc}; MOV r2, r9; MOVW r2; LDRD r4, r2; LDM r0, {r2, r3}; VMOV r2, s0; VMOV r2, r3, d0;
    // VLDMIA r2!; LDR r2, [sp]; LDR r2, [pc]; ADD r2, sp; LSLS r2, r0; LDRB r2, [r0, #4]; LDR r0, [r2], #4
    let writes = [
        (0x3201, 0),
        (0x6802, 0),
        (0xBD04, 0),
        (0x464A, 0),
        (0xF240, 0x0210),
        (0xE9D0, 0x4200),
        (0xE890, 0x000C),
        (0xEE10, 0x2A10),
        (0xEC53, 0x2B10),
        (0xECB2, 0x0A02),
        (0x9A1D, 0),
        (0x4A00, 0),
        (0xAA00, 0),
        (0x0042, 0),
        (0xF890, 0x2004),
        (0xF852, 0x0B04),
    ];
    assert!(writes.iter().all(|&(first, second)| may_write(2, first, second)), "{writes:x?}");
    // STR r0, [sp, #104]; LDR r0, [pc, #8]; ADD r0, sp, #8; CMP r1, #2; ADDS r3, #1; LDR r4, [r0]; MOVW r3; VADD.F32 s4, s4, s4; VLDR s5, [r2];
    // LDRB r12, [sp, #719]; LDR r3, [r0, #514]; ADD r0, r8, #260; MLA r0, r12,
    // r2, r0.
    let others = [
        (0x901A, 0),
        (0x4802, 0),
        (0xA802, 0),
        (0x2902, 0),
        (0x3301, 0),
        (0x6804, 0),
        (0xF240, 0x0310),
        (0xEE32, 0x2A02),
        (0xEDD2, 0x2A00),
        (0xF89D, 0xC2CF),
        (0xF8D0, 0x3202),
        (0xF508, 0x7082),
        (0xFB0C, 0x0002),
    ];
    assert!(!others.iter().any(|&(first, second)| may_write(2, first, second)), "{others:x?}");
}
