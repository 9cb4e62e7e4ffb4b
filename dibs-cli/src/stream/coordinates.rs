//! Converts positions of a live source to the tree's unit, axes and origin.

use anyhow::{Result, anyhow};
use dibs_build::glam::{DMat3, DQuat, DVec3, Vec3};
use dibs_build::{Motion, ReadErrorKind, Unit};
use dibs_nostd::RigidPose;
use dibs_stream::SurfaceOrder;
use std::str::FromStr;

/// The patient's axes, each with the letters of its two directions.
const AXES: [[char; 2]; 3] = [['R', 'L'], ['A', 'P'], ['S', 'I']];

/// The conversion of a source's positions to the tree's.
#[derive(Clone)]
pub struct SourceCoordinates {
    pub unit: Option<Unit>,
    pub axes: Option<Axes>,
    pub origin: DVec3,
    pub order: SurfaceOrder,
}

/// For each axis of the tree, the source's axis and its sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes([(usize, f64); 3]);

impl SourceCoordinates {
    /// Converts a frame in the mesh's order, and in the source's unit and axes, to the tree's.
    ///
    /// # Errors
    /// If the positions are not a frame of the tree's surface: a coordinate is not finite, the number of vertices or
    /// the size differs, or the surface is inside out.
    pub fn frame(&self, mut positions: Vec<[f64; 3]>, number: usize) -> Result<Vec<Vec3>> {
        if let Some(axes) = self.axes {
            positions.iter_mut().for_each(|position| *position = axes.turn(*position));
        }
        let positions = Motion::frame_around(&positions, number, self.unit, self.origin);
        let positions = positions.map_err(|error| match error {
            ReadErrorKind::NonFinite { vertex, value } => anyhow!(
                "{vertex} has the coordinate {value}, which is not a finite number: leave such frames out, and check \
                 the format"
            ),
            error => anyhow!("{error}"),
        })?;
        self.order.to_rows(&positions).map_err(|error| anyhow!("frame {number}: {error}"))?;
        Ok(positions)
    }

    /// Converts a point (mm) of a tool's own frame, which has this pose in the source's unit and axes, to the
    /// coordinates of the mesh's file.
    pub fn of_tool(&self, rotation: &DQuat, shift: DVec3, point: DVec3) -> DVec3 {
        let at = *rotation * point + shift * self.unit.map_or(1.0, Unit::millimetres);
        self.axes.map_or(at, |axes| axes.turn(at.to_array()).into())
    }

    /// Converts a pose in the source's unit and axes to the tree's. If the tree has an origin, the world frame has the
    /// same.
    ///
    /// # Errors
    /// If its translation is too large.
    pub fn pose(&self, rotation: &DQuat, shift: DVec3) -> Result<RigidPose> {
        let (mut rotation, mut shift) = (*rotation, shift);
        if let Some(axes) = self.axes {
            // By columns: each axis of the tree in the source's axes.
            let from = DMat3::from_cols_array_2d(
                &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| axes.turn(axis)),
            );
            rotation = DQuat::from_mat3(&(from * DMat3::from_quat(rotation) * from.transpose()));
            shift = axes.turn(shift.to_array()).into();
        }
        shift *= self.unit.map_or(1.0, Unit::millimetres);
        let shift = shift + rotation * self.origin - self.origin;
        let pose = RigidPose::new(rotation.as_quat().normalize(), shift.as_vec3());
        pose.map_err(|error| anyhow!("{error}"))
    }
}

impl Axes {
    fn turn(self, position: [f64; 3]) -> [f64; 3] {
        self.0.map(|(axis, sign)| sign * position[axis])
    }
}

impl FromStr for Axes {
    type Err = String;

    /// `FROM:TO`, three letters each.
    fn from_str(text: &str) -> Result<Self, String> {
        let directions = |text: &str| {
            let of = |letter: char| {
                let letter = letter.to_ascii_uppercase();
                let axis = AXES.iter().position(|pair| pair.contains(&letter))?;
                Some((axis, if AXES[axis][0] == letter { 1.0 } else { -1.0 }))
            };
            let found: Option<Vec<(usize, f64)>> = text.chars().map(of).collect();
            let found: [(usize, f64); 3] = found?.try_into().ok()?;
            (0..3).all(|axis| found.iter().any(|one| one.0 == axis)).then_some(found)
        };
        let both = text.split_once(':');
        let both = both.and_then(|(from, to)| Some((directions(from)?, directions(to)?)));
        let Some((from, to)) = both else {
            return Err(
                "give the frames' axes and the tree's as FROM:TO, say RAS:LPS; each has one of R and L, of A and P, and of S \
                 and I"
                    .to_owned(),
            );
        };
        let source = |(axis, sign): (usize, f64)| {
            let at = from.iter().position(|one| one.0 == axis).unwrap_or(axis);
            (at, sign * from[at].1)
        };
        Ok(Self(to.map(source)))
    }
}

#[cfg(test)]
mod tests {
    use super::{Axes, SourceCoordinates};
    use dibs_build::generate::heart;
    use dibs_build::glam::{DQuat, DVec3};
    use dibs_build::{Builder, Unit};
    use dibs_stream::SurfaceOrder;

    /// Converting a point and then applying the converted pose equals applying the pose and then converting the point:
    /// with other axes, metres, and another origin.
    #[test]
    fn a_pose_is_placed_as_its_points_are() {
        let built = Builder::new().build(&heart(320).expect("a size").mesh).expect("a tree");
        let order = SurfaceOrder::of(&built.tree::<u16>().expect("a tree"));
        let rotation = DQuat::from_scaled_axis(DVec3::new(0.3, -0.7, 1.1));
        let shift = DVec3::new(0.02, -0.05, 0.3);
        for axes in [None, Some("RAS:LPS"), Some("ALS:PIR"), Some("RAS:RAI")] {
            let axes = axes.map(|axes| axes.parse().expect("axes"));
            let origin = DVec3::new(300.0, -20.0, 1000.0);
            let place =
                SourceCoordinates { unit: Some(Unit::Metre), axes, origin, order: order.clone() };
            let placed = |point: DVec3| {
                let turned =
                    axes.map_or(point.to_array(), |axes: Axes| axes.turn(point.to_array()));
                DVec3::from(turned) * 1000.0 - origin
            };
            let pose = place.pose(&rotation, shift).expect("near");
            for point in [DVec3::ZERO, DVec3::new(0.1, 0.2, -0.4)] {
                let moved = pose.apply(placed(point).as_vec3()).as_dvec3();
                let truth = placed(rotation * point + shift);
                assert!(moved.abs_diff_eq(truth, 1e-2), "{moved} {truth} {axes:?}");
            }
        }
        let place = SourceCoordinates { unit: None, axes: None, origin: DVec3::ZERO, order };
        assert!(place.pose(&rotation, DVec3::splat(1e30)).is_err());
    }

    #[test]
    fn axes_are_turned_as_their_letters_say() {
        let turned = |text: &str| text.parse::<Axes>().map(|axes| axes.turn([1.0, 2.0, 3.0]));
        assert_eq!(turned("RAS:LPS"), Ok([-1.0, -2.0, 3.0]));
        assert_eq!(turned("lps:ras"), Ok([-1.0, -2.0, 3.0]));
        assert_eq!(turned("RAS:RAS"), Ok([1.0, 2.0, 3.0]));
        // ROS: forwards, left, up. Its first axis is A, the tree's second.
        assert_eq!(turned("ALS:RAS"), Ok([-2.0, 1.0, 3.0]));
        assert_eq!(turned("ALS:PIR"), Ok([-1.0, -3.0, -2.0]));
        for wrong in ["RAS", "RAS:", "RAS:RAL", "RAS:LPSS", "XYZ:RAS", "RRS:LPS"] {
            assert!(turned(wrong).is_err(), "{wrong}");
        }
    }
}
