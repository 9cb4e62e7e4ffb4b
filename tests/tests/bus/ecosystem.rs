//! Types and traits of other crates: byte streams of `embedded-io`, messages of `embedded-can`, points of `mint`, values
//! through `serde`.

// Requirements: B-09, P-11

use dibs_build::{Builder, BuiltTree, generate};
use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::{Answer, Bus, Guard, GuardLimits, Surface};
use dibs_nostd::wire::canfd::Identifiers;
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId, Freshness, enframe};
use dibs_nostd::{
    Advance, Budget, Capsule, Contacts, Cost, Millis, Options, Query, Side, SurfaceLimits, Ticks,
    Tree, TreeBytes,
};
use dibs_tests::bus::collect;
use embedded_can::{ExtendedId, Frame, Id};
use embedded_io::{ErrorKind, ErrorType, Read, Write};
use serde_json::{Value, from_str, json, to_string, to_value};

const ROWS: usize = 162;

type Ends<'t> = (Bus<'static, 't, u16>, Guard<'static, 't, u16, 64, 96>);

fn heart() -> (Vec<Vec3>, BuiltTree) {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&heart).expect("a valid mesh");
    (heart.positions, built)
}

fn start(built: &BuiltTree) -> Ends<'_> {
    let surface: &'static Surface<ROWS> = Box::leak(Box::new(Surface::new()));
    let limits = GuardLimits::new(300.0, Millis(100)).automatic();
    surface.start(TreeBytes::new(built.blob()), limits).expect("valid")
}

/// A frame's bytes on a serial line.
fn line(built: &BuiltTree, positions: &[Vec3]) -> Vec<u8> {
    let id = FrameId { mesh_id: built.summary().mesh_id, session: 1, epoch: 1 };
    let rows = built.to_rows(positions);
    let sender = FrameEncoder::<_, 256>::new(id, Encoding::Float, &rows[..]).expect("valid");
    let mut bytes = Vec::new();
    for packet in collect(sender.with_freshness(Freshness { age_ms: 0, echo: Some(1_000) })) {
        let mut framed = [0; 512];
        bytes.extend_from_slice(enframe(&packet, &mut framed).expect("room"));
    }
    bytes
}

/// A line that transfers this many bytes a call, and then fails.
struct Line<'b> {
    bytes: &'b [u8],
    taken: Vec<u8>,
    each: usize,
    room: usize,
}

impl ErrorType for Line<'_> {
    type Error = ErrorKind;
}

impl Read for Line<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        if self.bytes.is_empty() {
            return Err(ErrorKind::BrokenPipe);
        }
        let count = self.each.min(buffer.len()).min(self.bytes.len());
        let (now, later) = self.bytes.split_at(count);
        buffer[..count].copy_from_slice(now);
        self.bytes = later;
        Ok(count)
    }
}

impl Write for Line<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        if self.each == usize::MAX {
            return Err(ErrorKind::TimedOut);
        }
        let count = self.each.min(bytes.len()).min(self.room - self.taken.len());
        self.taken.extend_from_slice(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        panic!("a flush waits for the line");
    }
}

fn work(bus: &mut Bus<'_, '_, u16>) -> bool {
    loop {
        match bus.work(100).expect("admitted") {
            Advance::Pending => (),
            outcome => return matches!(outcome, Advance::Published { .. }),
        }
    }
}

/// The answer once the surface is trusted: the state is safe in the first second.
fn after_a_while<P: Copy + Into<Vec3>>(built: &BuiltTree, frame: &[P], tool: &Capsule) -> Answer {
    let (mut bus, mut guard) = start(built);
    for now in 1_000.. {
        if now % 20 == 0 {
            bus.frame(frame, Millis(now), Millis(now)).expect("a good frame");
            assert!(work(&mut bus));
        }
        let answer = guard.closest(tool, Millis(now));
        if answer.closest.is_ok() {
            return answer;
        }
        assert!(now < 3_000, "{answer:?}");
    }
    unreachable!("the loop has no end")
}

#[test]
fn a_stream_gives_and_takes_what_slices_do() {
    let (positions, built) = heart();
    let (bytes, now) = (line(&built, &positions), Millis(1_000));
    let (mut own, _) = start(&built);
    own.receive(&bytes, now);
    assert!(work(&mut own));
    let mut framed = [0; _];
    let status = own.status_framed(now, &mut framed).expect("news");
    for each in [1, 7, 64, 1_000] {
        let (mut bus, _) = start(&built);
        let mut stream = Line { bytes: &bytes, taken: Vec::new(), each, room: usize::MAX };
        let mut read = 0;
        let error = loop {
            match bus.receive_from(&mut stream, now) {
                Ok(count) => read += count,
                Err(error) => break error,
            }
        };
        assert_eq!((read, error), (bytes.len(), ErrorKind::BrokenPipe), "{each} a call");
        assert!(work(&mut bus), "{each} a call");
        assert_eq!(bus.send_status_to(&mut stream, now), Ok(status.len()), "{each} a call");
        assert_eq!(stream.taken, status, "{each} a call");
        assert_eq!(bus.send_status_to(&mut stream, now), Ok(0), "no news");
    }
    // A line that is full, and one that fails.
    let (mut bus, _) = start(&built);
    let mut full = Line { bytes: &[], taken: Vec::new(), each: 5, room: 12 };
    let later = Millis(2_000);
    assert_eq!(bus.send_status_to(&mut full, later), Ok(12));
    let mut broken = Line { bytes: &[], taken: Vec::new(), each: usize::MAX, room: 0 };
    assert_eq!(bus.send_status_to(&mut broken, Millis(3_000)), Err(ErrorKind::TimedOut));
}

/// A driver's message of at most this many bytes: 64 with CAN-FD, 8 without.
struct Message<const ROOM: usize> {
    id: Id,
    data: Vec<u8>,
    is_remote: bool,
}

impl<const ROOM: usize> Frame for Message<ROOM> {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        let id = id.into();
        (data.len() <= ROOM).then(|| Self { id, data: data.to_vec(), is_remote: false })
    }

    fn new_remote(id: impl Into<Id>, _: usize) -> Option<Self> {
        Some(Self { id: id.into(), data: Vec::new(), is_remote: true })
    }

    fn is_extended(&self) -> bool {
        matches!(self.id, Id::Extended(_))
    }

    fn is_remote_frame(&self) -> bool {
        self.is_remote
    }

    fn id(&self) -> Id {
        self.id
    }

    fn dlc(&self) -> usize {
        self.data.len()
    }

    fn data(&self) -> &[u8] {
        &self.data
    }
}

#[test]
fn messages_of_can_carry_a_frame_and_its_status() {
    let (positions, built) = heart();
    let (now, identifiers) = (Millis(1_000), Identifiers::new(0x120).expect("11 bits"));
    let id = FrameId { mesh_id: built.summary().mesh_id, session: 1, epoch: 1 };
    let rows = built.to_rows(&positions);
    let encoder = FrameEncoder::<_, 64>::new(id, Encoding::Float, &rows[..]).expect("valid");
    let (mut bus, _) = start(&built);
    for packet in collect(encoder.with_freshness(Freshness { age_ms: 0, echo: Some(1_000) })) {
        let message: Message<64> = identifiers.frame_of(&packet).expect("CAN-FD has the room");
        assert!(identifiers.frame_of::<Message<8>>(&packet).is_none(), "CAN has not");
        assert_eq!(identifiers.packet_to_sender(&message), None);
        // The same number with 29 bits is another identifier, and a request has no packet.
        let id = ExtendedId::new(0x122).expect("29 bits");
        assert_eq!(identifiers.packet_to_receiver(&Message::<64>::new(id, &packet).unwrap()), None);
        let request = Message::<64>::new_remote(message.id, 8).expect("a request");
        assert_eq!(identifiers.packet_to_receiver(&request), None);
        let received = identifiers.packet_to_receiver(&message).expect("for the receiver");
        bus.packet(received, now).expect("a good packet");
    }
    assert!(work(&mut bus), "published");
    let mut status = [0; 64];
    let status = bus.status(now, &mut status).expect("news");
    let message: Message<64> = identifiers.frame_of(status).expect("room");
    assert_eq!(identifiers.packet_to_sender(&message), Some(status));
    assert_eq!(identifiers.packet_to_receiver(&message), None);
}

#[test]
fn a_frame_of_mints_points_is_the_frame() {
    let (positions, built) = heart();
    let points: Vec<mint::Point3<f32>> = positions.iter().map(|&at| at.into()).collect();
    let tool = Capsule::new(Vec3::new(0.0, 0.0, 90.0), Vec3::new(0.0, 0.0, 150.0), 2.5).unwrap();
    let own = after_a_while(&built, &positions, &tool).closest.expect("an answer");
    assert_eq!(after_a_while(&built, &points, &tool).closest, Ok(own));
    let there: mint::Vector3<f32> = own.direction.into();
    assert_eq!(Vec3::from(there), own.direction);
}

#[test]
fn answers_are_logged_with_every_field() {
    let (positions, built) = heart();
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
    let mut query = Query::<_, 64>::new(&tree).expect("room");
    let tool = Capsule::new(Vec3::new(0.0, 0.0, 90.0), Vec3::new(0.0, 0.0, 150.0), 2.5).unwrap();
    let rows = built.to_rows(&positions);
    let answer = query.closest(rows.as_slice(), &tool, &Options::new()).expect("an answer");
    let found = to_value(answer).expect("written");
    assert_eq!(answer.side, Side::Outside);
    let point = answer.point_on_surface.to_array();
    assert_eq!(found["side"], json!("Outside"));
    assert_eq!(found["separation"], json!(answer.separation));
    assert_eq!(found["point_on_surface"], json!(point));
    assert_eq!(found["triangle"], json!(answer.triangle.expect("a triangle").0));
    assert_eq!(to_value(answer.interval()).unwrap()["lower"], json!(answer.interval().lower));

    let mut contacts = Contacts::<8, 512>::default();
    query.contacts(rows.as_slice(), &tool, 60.0, &Options::new(), &mut contacts).expect("contacts");
    let contact = contacts.iter().next().expect("a contact");
    let logged = to_value(contact).expect("written");
    assert_eq!(logged["normal"], json!(contact.normal.to_array()));
    assert!(logged.get("activation").is_none(), "what is private stays so");

    let now = Millis(1_000);
    let (_, mut guard) = start(&built);
    let none = to_value(guard.closest(&tool, now)).expect("written");
    assert_eq!(none["closest"], json!({ "Err": "NoSurface" }));
    let whole = to_value(after_a_while(&built, &positions, &tool)).expect("written");
    assert_eq!(whole["closest"]["Ok"]["side"], json!("Outside"));
    assert_eq!(whole["trust"]["state"], json!("Nominal"));
    let limits = GuardLimits::new(300.0, Millis(80)).budget(Budget::new(500));
    let limits = to_value(limits).expect("written");
    assert_eq!((&limits["age"], &limits["options"]["budget"]["tests"]), (&json!(80), &json!(500)));
}

#[test]
fn settings_come_back_as_they_were() {
    let cost = Cost { base: 4_000, node_test: 90, triangle_test: 700 };
    assert_eq!(from_str::<Cost>(&to_string(&cost).unwrap()).unwrap(), cost);
    for budget in [Budget::new(500), Budget::UNLIMITED] {
        assert_eq!(from_str::<Budget>(&to_string(&budget).unwrap()).unwrap(), budget);
    }
    assert_eq!(from_str::<(Millis, Ticks)>("[80, 7]").unwrap(), (Millis(80), Ticks(7)));
    let limits = SurfaceLimits::reach_mm(300.0);
    for limits in [limits, limits.speed(0.2).shrinkage(0.1), limits.recovery_mm(f32::INFINITY)] {
        assert_eq!(from_str::<SurfaceLimits>(&to_string(&limits).unwrap()).unwrap(), limits);
    }
    // A limit that refuses everything must not become no limit.
    assert!(to_string(&limits.speed(f32::NAN)).is_err());
    assert!(to_string(&limits.speed(f32::NEG_INFINITY)).is_err());
    let misspelt =
        r#"{"reach": 300, "sped": 0.2, "speed": 0.2, "recovery": 30, "shrinkage": 0.25}"#;
    assert!(from_str::<SurfaceLimits>(misspelt).is_err());
    assert!(
        from_str::<Cost>(r#"{"base": 1, "node": 2, "node_test": 2, "triangle_test": 3}"#).is_err()
    );
    assert!(from_str::<Value>(&to_string(&limits).unwrap()).unwrap()["speed"].is_null());
}
