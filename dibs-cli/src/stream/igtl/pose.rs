//! The pose of a surface, from messages of the types TRANSFORM, TDATA and QTDATA.

use super::Refusal;
use super::exchange::Cause;
use super::message::{Header, take};
use dibs_build::glam::{DMat3, DQuat, DVec3};

/// Size of a pose as matrix and shift, and as shift and quaternion.
const MATRIX: usize = 48;
const QUATERNION: usize = 28;

/// Bytes before it in an element of TDATA and QTDATA: a name, and after that the type and a reserved byte.
const NAME: usize = 20;
const BEFORE: usize = NAME + 2;

/// Tolerance for each number of a rotation matrix, and for a quaternion's length: sources round.
const TOLERANCE: f64 = 1e-3;

/// Types of messages that contain poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One pose, of the message's own device.
    Transform,
    /// Poses of several instruments with names: matrices, or quaternions.
    Tracks,
    Quaternions,
}

/// A rotation, followed by a translation, in the source's unit and axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    pub rotation: DQuat,
    pub shift: DVec3,
}

/// Why a content has no valid pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseError {
    /// It violates the protocol.
    Layout,
    /// Its matrix or quaternion is not a rotation: it scales, mirrors or shears.
    NoRotation,
}

impl Kind {
    pub fn of(name: &str) -> Option<Self> {
        match name {
            "TRANSFORM" => Some(Self::Transform),
            "TDATA" => Some(Self::Tracks),
            "QTDATA" => Some(Self::Quaternions),
            _ => None,
        }
    }

    /// Whether the pose is that of the message's device, and not of an element of its content.
    const fn is_of_device(self) -> bool {
        matches!(self, Self::Transform)
    }

    /// Whether a message with this header may have that device's pose.
    pub fn is_of(self, header: &Header, device: &str) -> bool {
        !self.is_of_device() || header.device == device
    }

    /// The right size of a content, in words.
    fn size(self) -> String {
        match self {
            Self::Transform => format!("{MATRIX}"),
            Self::Tracks => format!("{} for each instrument", BEFORE + MATRIX),
            Self::Quaternions => format!("{} for each instrument", BEFORE + QUATERNION),
        }
    }

    /// The pose of a device, or why the message is refused; `None` if the content only has other devices' poses.
    pub fn pose(self, content: &[u8], device: &str) -> Result<Option<Pose>, Refusal> {
        self.read(content, device).map_err(|error| match error {
            PoseError::Layout => {
                let size = self.size();
                let why = format!("its content has {} bytes, and should have {size}", content.len());
                (Cause::Layout, why)
            }
            PoseError::NoRotation => {
                let why =
                    "its matrix or quaternion is no rotation, or a number is not finite: a pose neither scales nor mirrors";
                (Cause::Pose, why.to_owned())
            }
        })
    }

    fn read(self, content: &[u8], device: &str) -> Result<Option<Pose>, PoseError> {
        match self {
            Self::Transform if content.len() != MATRIX => Err(PoseError::Layout),
            Self::Transform => of_matrix(content).map(Some),
            Self::Tracks => named(content, BEFORE + MATRIX, device)?.map(of_matrix).transpose(),
            Self::Quaternions => {
                named(content, BEFORE + QUATERNION, device)?.map(of_quaternion).transpose()
            }
        }
    }
}

/// The numbers of the element with this name.
fn named<'a>(content: &'a [u8], size: usize, name: &str) -> Result<Option<&'a [u8]>, PoseError> {
    if !content.len().is_multiple_of(size) {
        return Err(PoseError::Layout);
    }
    let mut elements = content.chunks_exact(size);
    let has_name = |element: &&[u8]| {
        let given = element[..NAME].split(|&byte| byte == 0).next().unwrap_or_default();
        given == name.as_bytes()
    };
    Ok(elements.find(has_name).map(|element| &element[BEFORE..]))
}

fn numbers<const N: usize>(mut bytes: &[u8]) -> Result<[f64; N], PoseError> {
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        let bytes = take(&mut bytes, 4).and_then(|bytes| bytes.try_into().ok());
        *number = bytes.map(f32::from_be_bytes).ok_or(PoseError::Layout)?.into();
    }
    Ok(numbers)
}

/// From three columns of the rotation, then the translation.
fn of_matrix(bytes: &[u8]) -> Result<Pose, PoseError> {
    let numbers: [f64; 12] = numbers(bytes)?;
    let [first, second, third, shift] =
        [0, 3, 6, 9].map(|at| DVec3::new(numbers[at], numbers[at + 1], numbers[at + 2]));
    let matrix = DMat3::from_cols(first, second, third);
    if !(matrix.determinant() > 0.0 && shift.is_finite()) {
        return Err(PoseError::NoRotation);
    }
    let rotation = DQuat::from_mat3(&matrix).normalize();
    // False for numbers that are not finite.
    let is_one = DMat3::from_quat(rotation).abs_diff_eq(matrix, TOLERANCE);
    is_one.then_some(Pose { rotation, shift }).ok_or(PoseError::NoRotation)
}

/// From the translation, then x, y, z and w.
fn of_quaternion(bytes: &[u8]) -> Result<Pose, PoseError> {
    let [a, b, c, x, y, z, w] = numbers(bytes)?;
    let (shift, rotation) = (DVec3::new(a, b, c), DQuat::from_xyzw(x, y, z, w));
    let is_one = (rotation.length() - 1.0).abs() <= TOLERANCE && shift.is_finite();
    is_one.then(|| Pose { rotation: rotation.normalize(), shift }).ok_or(PoseError::NoRotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(numbers: &[f32]) -> Vec<u8> {
        numbers.iter().flat_map(|number| number.to_be_bytes()).collect()
    }

    /// A quarter turn about z: x becomes y.
    const TURN: [f32; 12] = [0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 4.0, 5.0, 6.0];

    fn element(name: &str, numbers: &[f32]) -> Vec<u8> {
        let name = name.bytes().chain([0; NAME]).take(NAME);
        name.chain([1, 0]).chain(bytes(numbers)).collect()
    }

    #[test]
    fn a_pose_is_read_from_each_type() {
        let half = 0.5_f32.sqrt();
        let turn = [4.0, 5.0, 6.0, 0.0, 0.0, half, half];
        let others = element("needle", &[0.0; 12]);
        let tracks = [others, element("organ", &TURN)].concat();
        let quaternions = [element("needle", &[0.0; 7]), element("organ", &turn)].concat();
        for (kind, content) in [
            (Kind::Transform, bytes(&TURN)),
            (Kind::Tracks, tracks),
            (Kind::Quaternions, quaternions),
        ] {
            let pose = kind.read(&content, "organ").expect("right").expect("there");
            assert_eq!(pose.shift, DVec3::new(4.0, 5.0, 6.0));
            assert!((pose.rotation * DVec3::X).abs_diff_eq(DVec3::Y, 1e-6), "{pose:?}");
            assert!((pose.rotation * DVec3::Y).abs_diff_eq(-DVec3::X, 1e-6), "{pose:?}");
            let other = if kind.is_of_device() { Ok(Some(pose)) } else { Ok(None) };
            assert_eq!(kind.read(&content, "orga"), other, "a name that begins like it");
            assert_eq!(kind.read(&content[1..], "organ"), Err(PoseError::Layout));
        }
        assert_eq!(Kind::Tracks.read(&[], "organ"), Ok(None));
    }

    #[test]
    fn what_is_no_rotation_is_refused() {
        let with = |at: usize, value: f32| {
            let mut numbers = TURN;
            numbers[at] = value;
            Kind::Transform.read(&bytes(&numbers), "")
        };
        // A reflection, a scaling, a shear, and numbers that are not finite.
        for (at, value) in
            [(8, -1.0), (8, 1.01), (0, 0.01), (1, f32::NAN), (4, f32::INFINITY), (9, f32::NAN)]
        {
            assert_eq!(with(at, value), Err(PoseError::NoRotation), "{value} at {at}");
        }
        assert_eq!(Kind::Transform.read(&[0; 48], ""), Err(PoseError::NoRotation));
        let longer = element("organ", &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.01]);
        assert_eq!(Kind::Quaternions.read(&longer, "organ"), Err(PoseError::NoRotation));
        assert!(with(8, 1.0005).is_ok(), "rounded");
    }
}
