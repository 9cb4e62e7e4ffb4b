//! What the commits of the restructuring state.

pub const TEXT: &str = "## Merged

| stood | lines | is | lines | commit |
|---|---:|---|---:|---|
| four odometers: a tracker's front, a list's range, leaves around a point, a depth's bounds | 541 | `query/memory/`: one clock, one type of deadline | 791 | d7b3a98b |
| children, leaf, pop and budget of plain, limited, batched, range, tracked and point searches | 570 | `search/meter.rs`, `node.rs`, `leaf.rs` | 539 | 40ab2a0c |
| five look-ups of a triangle's corners | 83 | `query/corners.rs` | 74 | d6132a92 |
| merges of pairs in `chain.rs`, `several.rs`, `solids.rs` | 45 | `or_nearer` in `proximity.rs` | 34 | daa62ae5 |
| arrays with a count, in ten places | 157 | `heapless::Vec` | 117 | 2a86028b |
| buffers with their sizes in the types of reader, writer, assembler, C and Python | 429 | slices | 373 | ea07120e |
| two comparisons of a frame's rows, in assembler and monitor | 15 | the assembler's | 44 | 0cb68f77 |
| reach, error, velocities and the way from packets to an answer, in seven places | 669 | `guard/` | 1,172 | 4658e7df |
| one crate for builder, sender and program | 266 | three | 366 | b8faccd5 |

Lines that the commits remove and add, documentation and tests included; of daa62ae5 those of these files. `firmware-example`
went from 2,379 to 2,197 with the guard; its hand, filter and network came later.

## Not merged

- **A list takes two searches.** It depends on side and depth, which the first finds; a tool inside or beyond the margin
  needs no second one (docs/decisions.md).
- **`chain.rs` and `several.rs` stay apart.** One searches every pair in each call, the other only those that the last tick
  does not rule out; they share `or_nearer`.
- **A list holds the workspace of its search**, emptied before each: on a controller's stack it would be too much.
- **A mode's weight travels as a row's `x`**, so that packets, buffers and reader are those of positions, and has an
  extrapolation of its own (docs/decisions.md). `AdmissionCheck` keeps six hidden methods: what the library's own checks
  tell the receiver.
- **Decisions stand on one page**, each with its module, not beside it.
- **`wire/` imports `math`, `surface` and `tree`**, and nothing of the search.

## Counts of the same steps

Of 123 recorded rows two rose by more than 2 % from a3933105, before the first step, to 4b38ce4f, after the first six of
these: several trackers from 15,327 to 15,958 instructions (4.1 %) and a tracker's contacts from 136,376 to 140,362
(2.9 %). Both have read their memory through the one text since, and no other form of it was tried for them alone.
Receiving and checking fell by 4 to 7 %, where a pass disappeared. Three steps came later: 40ab2a0c states less than 1 %
(a warm query from 26,497 to 26,658), 2a86028b 2 % up or down, d6132a92 nothing. In each of the steps the
answers are the same to the bit (`tests/tests/query/answers.rs`); four mends of defects between them changed lists of
contacts: 478fd741, f88c8fc5, d7420c00, fc88a5b5.

## Time of `cargo xtask test`

Goal: 12 minutes on two idle cores, and two more for each of the four capabilities added since, so 20. On 2026-11-29 it
took 8 minutes if nothing had changed, 17 after a change of the core, and 23 to 28 with nothing compiled: then 16 of 42
minutes of one core are release builds. Done: fewer cases of the slowest tests (2219002c, 2ed50cb0), lanes of equal length
(9c8c5eea, b11f13ae). Tried and dropped (2ed50cb0): no optimisation across a crate's parts, a sixth less to compile, but
five times the instructions of a batched search; level 2 for the tests, a quarter less for their crate, but 8 to 26 % more
counted instructions.

## Read by an outsider

Commit f9d49866 has the corrections.

| module | what a reader stumbled over | what changed |
|---|---|---|
| `query/memory/` | beyond half a turn of the clock its saturated count passed for the whole motion: a broken promise | such bounds are forgotten; the test failed before |
| | `forget` forgot only the last tick; `FARTHEST` was a time between tests | `forget_tick`, `LONGEST_WAIT`, held beside the longest bound when it is compiled |
| `receive/` | what the time of a heartbeat counts from; heads that said less than their files do | both stated; heartbeats have a file |
| `query/contacts/` | a list's RAM, right for eight places by accident | stated and asserted: 152 bytes a contact |
| | `has_side` for a side that was searched; `settle` | `is_side_searched`, `resolve_side` |
";
