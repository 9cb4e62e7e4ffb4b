//! The signed separation from several solids: the least of theirs.
//!
//! Each solid has its own sign, from its own closest sheet: where solids overlap or contain each other, the closest
//! sheet of all decides nothing. The least separation changes by no more than tool and surface move, as each solid's
//! does.

// Requirement: S-02

use super::Proximity;
use super::memory::depth::KnownDepthMut;
use super::search::{Search, Ties, WHOLE, WaitingNode};
use super::separation::Request;
use super::sides::{NoSide, Side};
use crate::math::order::smaller;
use crate::math::sqrt::sqrt;
use crate::tree::RootSet;
use crate::unavailable::QueryError;
use crate::{Index, Tool, VertexTable};

/// Makes `answer`, the closest pair of all shells, the signed answer.
#[cold]
#[inline(never)]
pub(super) fn signed<I: Index, V: VertexTable + ?Sized, T: Tool>(
    asked: &Request<'_, '_, I, V, T>,
    stack: &mut [WaitingNode],
    answer: &mut Proximity,
    memory: (&mut Ties, Option<KnownDepthMut<'_>>),
) -> Result<(), QueryError> {
    let &Request { tree, vertices, tool, options } = asked;
    let closest = *answer;
    let root = closest.triangle.map_or(0, |row| tree.root_of(row.0));
    let nearest = tree.shells_of(root);
    asked.signed(stack, answer, memory, nearest)?;
    if answer.side == Side::Undefined(NoSide::CutShort) {
        return Ok(());
    }
    let stretch = options.stretch.or_else(|| vertices.stretch());
    let stretch = stretch.map_or(tree.stretch(), |measured| measured.sigma());
    for solid in 0..=tree.header().other_roots {
        let is_closest = tree.solid_of(root) == Some(solid);
        if tree.solid_of(solid) != Some(solid) || is_closest {
            continue;
        }
        let (pin, radius, _) = tree.node(solid).ok_or(QueryError::Corrupt { row: solid })?;
        let pin = vertices.position(pin).ok_or(QueryError::Corrupt { row: pin })?;
        // A solid lies within its outer shell's sphere. The rounding of both sides is less than the accuracy.
        let apart = sqrt(tool.axis_distance_squared(pin)) - radius * stretch;
        if apart > closest.accuracy {
            continue;
        }
        let roots = tree.shells_of(solid);
        let other = of_solid(asked, stack, answer, roots)?;
        *answer = nearer(*answer, other, tool);
    }
    answer.axis_distance = closest.axis_distance;
    Ok(())
}

/// The signed answer of one solid, with the budget left after the answer's tests so far.
fn of_solid<I: Index, V: VertexTable + ?Sized, T: Tool>(
    asked: &Request<'_, '_, I, V, T>,
    stack: &mut [WaitingNode],
    answer: &Proximity,
    roots: RootSet,
) -> Result<Proximity, QueryError> {
    let &Request { tree, vertices, tool, options } = asked;
    let rest = options.after(answer.tests());
    let asked = Request { options: &rest, ..*asked };
    let mut ties = Ties::new();
    let memory = Some(&mut ties);
    let search = Search::start(roots, tree, stack, vertices, tool, &rest, None, memory)?;
    let mut found = search.run::<WHOLE>(f32::INFINITY)?;
    asked.signed(stack, &mut found, (&mut ties, None), roots)?;
    Ok(found)
}

/// The nearer answer of two solids, with the interval and test counts of both. The tool is inside if it is inside one
/// of them; if one side is unknown, so is the result's.
fn nearer(one: Proximity, other: Proximity, tool: &impl Tool) -> Proximity {
    let is_nearer = other.separation < one.separation;
    let (near, farther) = if is_nearer { (other, one) } else { (one, other) };
    let mut nearer = one.or_nearer(other);
    nearer.lower = smaller(near.lower, least_possible(&farther, tool));
    if nearer.side == Side::Outside && matches!(farther.side, Side::Undefined(_)) {
        nearer.side = farther.side;
        nearer.lower = smaller(nearer.separation, farther.lower);
    }
    nearer
}

/// The least separation that an answer allows. Without a side the axis may be inside, no deeper than its closest
/// distance plus its length.
fn least_possible(answer: &Proximity, tool: &impl Tool) -> f32 {
    match answer.side {
        Side::Undefined(_) => -(answer.axis_distance + tool.axis_length()) - tool.radius(),
        _ => answer.lower,
    }
}
