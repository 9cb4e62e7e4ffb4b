/**
 * @file
 * dibs: the closest point between a tool and a deforming mesh, on a microcontroller.
 *
 * Objects are made by an `_init` function in storage of the caller's: of the size that a constant states or more, aligned
 * to `DIBS_ALIGNMENT`, without an initial value, and kept, unmoved, for as long as the object is used. Nothing is
 * allocated, but by `dibs_sender`.
 *
 * Calls return a `dibs_code`: `DIBS_CODE_OK`, an error of the call's own, or a misuse, which is one of the codes below 100.
 * After an error nothing is written to the places for results, unless a function says otherwise.
 *
 * A pointer is null, or it points to as much as its function says: more is not checked. Lengths are in mm, to which a
 * tree's builder converts its file's unit; positions are in the mesh's frame.
 */
/* Generated from bindings/c/src by `DIBS_WRITE=1 cargo test -p dibs-c header`. */


#ifndef DIBS_H
#define DIBS_H

#include <stddef.h>
#include <stdint.h>
/** Bytes of the storage of a surface of so many vertices. */
#define DIBS_SURFACE_SIZE(vertices) (DIBS_SURFACE_BASE + (size_t)DIBS_SURFACE_VERTEX * (vertices))

/** Bytes of the storage of a guarded surface of so many vertices. */
#define DIBS_GUARDED_SIZE(vertices) (DIBS_SURFACE_BASE + (size_t)DIBS_GUARDED_VERTEX * (vertices))

/** Bytes of the memory of a loop's objects, on a tree of so many vertices. */
#define DIBS_START_SIZE(vertices) (DIBS_START_BASE + DIBS_GUARDED_SIZE(vertices))

/** Bytes of the storage of a tracker on a tree of so many vertices. */
#define DIBS_TRACKER_SIZE(vertices) (DIBS_TRACKER_BASE + (size_t)DIBS_TRACKER_VERTEX * (vertices))


/**
 * Bytes of an account's storage.
 */
#define DIBS_ACCOUNT_SIZE 64

/**
 * Alignment, in bytes, of the storage of every object: a computer's cipher needs that much.
 */
#define DIBS_ALIGNMENT 16

/**
 * Bytes of a bus's storage.
 */
#define DIBS_BUS_SIZE 3136

/**
 * Bytes of a list's storage.
 */
#define DIBS_CONTACTS_SIZE 13056

/**
 * Contacts that a list holds; if there are more, the deepest.
 */
#define DIBS_CONTACTS 16

/**
 * Triangles that a search for contacts considers at once; if there are more, the nearest.
 */
#define DIBS_NEAR 512

/**
 * Bytes of a machine's storage.
 */
#define DIBS_FAILSAFE_SIZE 192

/**
 * Most tools of a filter's chain.
 */
#define DIBS_FILTER_TOOLS 8

/**
 * Most rows that a caller may add.
 */
#define DIBS_FILTER_ROWS 8

/**
 * Most labels with a stand-off of their own.
 */
#define DIBS_FILTER_LABELS 4

/**
 * Bytes of a frame's storage.
 */
#define DIBS_FRAME_SIZE 192

/**
 * Bytes of a guard's storage.
 */
#define DIBS_GUARD_SIZE 25344

/**
 * Bytes of a query's storage.
 */
#define DIBS_QUERY_SIZE 4864

/**
 * For a budget: unlimited work. For a pair of limits: no limit.
 */
#define DIBS_UNLIMITED UINT32_MAX

/**
 * A flag of options: neither answer nor cost depends on earlier queries.
 */
#define DIBS_COLD 1

/**
 * A flag of options: the side is not determined, which saves its cost. The separation is that of a tool outside.
 */
#define DIBS_UNSIGNED 2

/**
 * A flag of options: lists only contacts of the triangles with the options' label, as if the others did not exist.
 */
#define DIBS_CONTACTS_OF 4

/**
 * Row of a triangle if there is none.
 */
#define DIBS_NO_TRIANGLE UINT32_MAX

/**
 * Bytes of a reader's storage.
 */
#define DIBS_READER_SIZE 128

/**
 * Bytes of a receiver's storage.
 */
#define DIBS_RECEIVER_SIZE 3072

/**
 * Largest packet of a byte stream: that of an Ethernet frame.
 */
#define DIBS_MTU 1472

/**
 * Largest status, framed or not.
 */
#define DIBS_STATUS 98

/**
 * Events that a receiver counts.
 */
#define DIBS_EVENTS 27

/**
 * Largest number of surfaces in a scene.
 */
#define DIBS_SURFACES 8

/**
 * Bytes of a sender's storage.
 */
#define DIBS_SENDER_SIZE 1024

/**
 * The age of a frame whose time of capture is unknown: the frame counts as captured when it is sent, unless it equals
 * the last one in every bit.
 */
#define DIBS_AGE_UNKNOWN UINT32_MAX

/**
 * Bytes of the memory for a control loop's objects, except the surface.
 */
#define DIBS_START_BASE ((DIBS_TREE_SIZE + DIBS_BUS_SIZE) + DIBS_GUARD_SIZE)

/**
 * Bytes of a surface's storage in addition to its vertices.
 */
#define DIBS_SURFACE_BASE 576

/**
 * Bytes of a surface's storage for each vertex: two positions.
 */
#define DIBS_SURFACE_VERTEX 24

/**
 * Bytes of a guarded surface's storage for each vertex: three positions.
 */
#define DIBS_GUARDED_VERTEX 36

/**
 * Bytes of the storage of a receiver's tags.
 */
#define DIBS_TAGS_SIZE 1792

/**
 * Bytes of a key.
 */
#define DIBS_KEY 16

/**
 * Largest number of tools in a chain.
 */
#define DIBS_TOOLS 16

/**
 * Bytes of a tracker's storage in addition to its vertices.
 */
#define DIBS_TRACKER_BASE 24896

/**
 * Bytes of a tracker's storage for each vertex: the present and the previous surface.
 */
#define DIBS_TRACKER_VERTEX 24

/**
 * Nodes of the tree that a tracker remembers: if a search opens more, ticks are whole queries.
 */
#define DIBS_OPENED 256

/**
 * Bytes of a tree's storage.
 */
#define DIBS_TREE_SIZE 640

/**
 * Bytes of a scrub's storage.
 */
#define DIBS_SCRUB_SIZE 128

/**
 * The header's version: a million times the major number, plus a thousand times the minor number, plus the patch
 * number.
 */
#define DIBS_VERSION 1000

/**
 * Bytes of a writer's storage.
 */
#define DIBS_WRITER_SIZE 256

/**
 * The outcome of a call. Numbers stay the same in all versions; those from 1 to 99 are misuses.
 */
enum dibs_code
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * No error.
   */
  DIBS_CODE_OK = 0,
  /**
   * A pointer is null.
   */
  DIBS_CODE_NULL = 1,
  /**
   * A pointer is not aligned for its type.
   */
  DIBS_CODE_MISALIGNED = 2,
  /**
   * The storage has fewer bytes than the object's `_SIZE`.
   */
  DIBS_CODE_STORAGE_SIZE = 3,
  /**
   * The storage is not aligned to `DIBS_ALIGNMENT`.
   */
  DIBS_CODE_STORAGE_ALIGNMENT = 4,
  /**
   * No object of this kind was made in that storage.
   */
  DIBS_CODE_NOT_INITIALISED = 5,
  /**
   * Another call that has not returned uses the object.
   */
  DIBS_CODE_IN_USE = 6,
  /**
   * This end of the surface's buffers was taken before: there is one receiver and one reader.
   */
  DIBS_CODE_TAKEN = 7,
  /**
   * A frame is held already: release it first.
   */
  DIBS_CODE_HELD = 8,
  /**
   * The objects are of different trees, or of different numbers of vertices.
   */
  DIBS_CODE_OTHER_TREE = 9,
  /**
   * A number that is not allowed: flags, counts, states.
   */
  DIBS_CODE_ARGUMENT = 10,
  /**
   * The caller's buffer is too small for the result.
   */
  DIBS_CODE_CAPACITY = 11,
  /**
   * The library is of another version than the header.
   */
  DIBS_CODE_VERSION = 12,
  /**
   * The tree has fewer bytes than its header states.
   */
  DIBS_CODE_TREE_LENGTH = 100,
  /**
   * The bytes are not a tree.
   */
  DIBS_CODE_TREE_MAGIC = 101,
  /**
   * The tree is of another format version: build it again.
   */
  DIBS_CODE_TREE_VERSION = 102,
  /**
   * The tree's indices have another width than the library's: 16 bits, or 32 with the feature `large`.
   */
  DIBS_CODE_TREE_WIDTH = 103,
  /**
   * The tree's bytes changed since they were written.
   */
  DIBS_CODE_TREE_CHECKSUM = 104,
  /**
   * The tree is not well formed: no builder writes such bytes.
   */
  DIBS_CODE_TREE_FORM = 105,
  /**
   * The tree's bytes changed since they were validated.
   */
  DIBS_CODE_TREE_CORRUPT = 106,
  /**
   * The tree was built without the section that stretch is measured with.
   */
  DIBS_CODE_TREE_NO_METRIC = 107,
  /**
   * The tree was built without adjacency: sides and contacts need it.
   */
  DIBS_CODE_TREE_NO_ADJACENCY = 108,
  /**
   * The tree was built without its rest shape, or has no such row.
   */
  DIBS_CODE_TREE_NO_REST_SHAPE = 109,
  /**
   * The tree was built without displacement modes, or without the rest shape that they displace.
   */
  DIBS_CODE_TREE_NO_MODES = 110,
  /**
   * A coordinate of the tool is not finite or too large.
   */
  DIBS_CODE_TOOL_COORDINATE = 200,
  /**
   * The tool's radius is negative, not finite or too large.
   */
  DIBS_CODE_TOOL_RADIUS = 201,
  /**
   * The surface's number of vertices is not the tree's.
   */
  DIBS_CODE_VERTEX_COUNT = 202,
  /**
   * The position of a vertex is not finite or too large.
   */
  DIBS_CODE_POSITION = 203,
  /**
   * The stretch was measured with another tree.
   */
  DIBS_CODE_STRETCH_OF_OTHER_TREE = 204,
  /**
   * The stretch was measured on another frame.
   */
  DIBS_CODE_STRETCH_OF_OTHER_FRAME = 205,
  /**
   * The surface is stretched beyond the limit given to the query.
   */
  DIBS_CODE_UNCOVERED = 206,
  /**
   * The margin is negative, not finite, or larger than that of the contacts.
   */
  DIBS_CODE_MARGIN = 207,
  /**
   * The query failed for another cause.
   */
  DIBS_CODE_QUERY_FAILED = 208,
  /**
   * No surface was published, or not for long enough since the start, or the frame is empty.
   */
  DIBS_CODE_NO_SURFACE = 300,
  /**
   * The surface is older than allowed.
   */
  DIBS_CODE_STALE = 301,
  /**
   * No good packet came for longer than allowed.
   */
  DIBS_CODE_LINK_LOST = 302,
  /**
   * No heartbeat came for longer than allowed.
   */
  DIBS_CODE_HEARTBEAT_LOST = 303,
  /**
   * More frames were refused or abandoned than allowed.
   */
  DIBS_CODE_REJECTIONS = 304,
  /**
   * The transit of the surface was longer than allowed.
   */
  DIBS_CODE_DELAYED = 305,
  /**
   * The surface was older than allowed when it was sent.
   */
  DIBS_CODE_SOURCE_STALE = 306,
  /**
   * More packets were forged than allowed.
   */
  DIBS_CODE_FORGERIES = 307,
  /**
   * The tool's axis touches the surface: no direction leads out.
   */
  DIBS_CODE_NO_DIRECTION = 308,
  /**
   * The budget ended before the side or the contacts were known.
   */
  DIBS_CODE_CUT_SHORT = 309,
  /**
   * A number is not finite.
   */
  DIBS_CODE_NOT_FINITE = 310,
  /**
   * A triangle is stretched beyond its limit.
   */
  DIBS_CODE_STRETCH_EXCEEDED = 311,
  /**
   * A region of the surface has shrunk below its limit.
   */
  DIBS_CODE_SHRUNK = 312,
  /**
   * A vertex moved farther than the limits on speed and recovery allow.
   */
  DIBS_CODE_TOO_FAST = 313,
  /**
   * There is no surface, for another cause.
   */
  DIBS_CODE_UNAVAILABLE = 314,
  /**
   * The tool's side is not known, so it may be inside.
   */
  DIBS_CODE_NO_SIDE = 315,
  /**
   * A closed surface is mirrored or inside out.
   */
  DIBS_CODE_INSIDE_OUT = 316,
  /**
   * The tool has no pose at this tick.
   */
  DIBS_CODE_NO_POSE = 317,
  /**
   * The surface was good for long enough, and the safe state waits for its acknowledgement.
   */
  DIBS_CODE_UNACKNOWLEDGED = 318,
  /**
   * The packet's checksum does not match, or it is too short for one.
   */
  DIBS_CODE_PACKET_DAMAGED = 400,
  /**
   * The packet is of another version of the protocol.
   */
  DIBS_CODE_PACKET_VERSION = 401,
  /**
   * The packet's checksum is right, but its form is not.
   */
  DIBS_CODE_PACKET_FORM = 402,
  /**
   * The packet is of another mesh.
   */
  DIBS_CODE_PACKET_MESH = 403,
  /**
   * The packet's tag is missing or not authentic.
   */
  DIBS_CODE_PACKET_FORGED = 404,
  /**
   * The packet's frame is not later than the published one.
   */
  DIBS_CODE_PACKET_STALE = 405,
  /**
   * The packet's frame is not being received.
   */
  DIBS_CODE_PACKET_UNEXPECTED = 406,
  /**
   * The previous frame is still being checked.
   */
  DIBS_CODE_PACKET_BUSY = 407,
  /**
   * The partial frame is not based on the published frame.
   */
  DIBS_CODE_PACKET_BASE = 408,
  /**
   * Rows came before the published frame was copied up to them.
   */
  DIBS_CODE_PACKET_NOT_READY = 409,
  /**
   * The frame's rows are not those of this surface.
   */
  DIBS_CODE_PACKET_ROWS = 410,
  /**
   * The frame's content or encoding is not accepted here.
   */
  DIBS_CODE_PACKET_ENCODING = 411,
  /**
   * The packet's position in the frame does not fit the others, or leaves too many gaps.
   */
  DIBS_CODE_PACKET_ORDER = 412,
  /**
   * A coordinate in the packet is not finite.
   */
  DIBS_CODE_PACKET_NOT_FINITE = 413,
  /**
   * A coordinate in the packet is beyond the reach.
   */
  DIBS_CODE_PACKET_TOO_FAR = 414,
  /**
   * The packets are not all of one frame.
   */
  DIBS_CODE_PACKET_DIGEST = 415,
  /**
   * Bytes between two zeros of the stream are not a packet.
   */
  DIBS_CODE_FRAMING = 416,
  /**
   * The packet was refused for another cause.
   */
  DIBS_CODE_PACKET_REFUSED = 417,
  /**
   * The surface was captured before the published one.
   */
  DIBS_CODE_PACKET_EARLIER = 418,
  /**
   * The surface's age was 65,535 ms or more when it was sent, or its capture is in the future.
   */
  DIBS_CODE_PACKET_TOO_OLD = 419,
  /**
   * A hello came too soon after another one to be answered at once.
   */
  DIBS_CODE_PACKET_THROTTLED = 420,
  /**
   * A stiffness, damping, largest force or margin is out of range.
   */
  DIBS_CODE_GAIN = 500,
  /**
   * A safe limit is below the degraded one.
   */
  DIBS_CODE_LIMIT_ORDER = 501,
  /**
   * A limit is 2^31 or more, or the age has no limit.
   */
  DIBS_CODE_LIMIT_TOO_LONG = 502,
  /**
   * The tissue's speed is negative or not finite.
   */
  DIBS_CODE_LIMIT_SPEED = 503,
  /**
   * The number of frames that recover is 0.
   */
  DIBS_CODE_LIMIT_RECOVERY = 504,
  /**
   * The acknowledgement came before the machine waited for it.
   */
  DIBS_CODE_ACKNOWLEDGE = 505,
  /**
   * A limit is so high that its input can never exceed it.
   */
  DIBS_CODE_LIMIT_UNTRIPPABLE = 506,
  /**
   * A stand-off, speed, lever arm, approach, period or uncertainty of a filter is out of range, or no triangle has a
   * label that it names.
   */
  DIBS_CODE_FILTER = 507,
  /**
   * A sender's target is invalid, or cannot be opened.
   */
  DIBS_CODE_SENDER_TARGET = 600,
  /**
   * The positions are not a frame of the sender's surface, or cannot be sent.
   */
  DIBS_CODE_SENDER_FRAME = 601,
  /**
   * The sender's connection broke.
   */
  DIBS_CODE_SENDER_LINE = 602,
  /**
   * Another sender has taken over the receiver.
   */
  DIBS_CODE_SENDER_SUPERSEDED = 603,
  /**
   * The receiver has another surface than the sender.
   */
  DIBS_CODE_SENDER_OTHER_SURFACE = 604,
  /**
   * The sender has a key, but the receiver has not answered with its challenge yet.
   */
  DIBS_CODE_SENDER_NO_CHALLENGE = 605,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum dibs_code dibs_code;
#else
typedef uint32_t dibs_code;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The outcome of a packet.
 */
enum dibs_progress
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * No packet is complete yet.
   */
  DIBS_PROGRESS_NONE = 0,
  /**
   * A frame began.
   */
  DIBS_PROGRESS_BEGUN = 1,
  /**
   * The packet was accepted.
   */
  DIBS_PROGRESS_STORED = 2,
  /**
   * The packet was a repetition, and was ignored.
   */
  DIBS_PROGRESS_DUPLICATE = 3,
  /**
   * The frame is complete: `dibs_receiver_advance` checks and publishes it.
   */
  DIBS_PROGRESS_COMPLETE = 4,
  /**
   * The packet was a heartbeat of the sender.
   */
  DIBS_PROGRESS_HEARTBEAT = 5,
  /**
   * The packet was a hello, which asks for a status: it is due now.
   */
  DIBS_PROGRESS_HELLO = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum dibs_progress dibs_progress;
#else
typedef uint32_t dibs_progress;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The outcome of a slice of work.
 */
enum dibs_advance
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * No complete frame waits to be checked.
   */
  DIBS_ADVANCE_IDLE = 0,
  /**
   * More work is left.
   */
  DIBS_ADVANCE_PENDING = 1,
  /**
   * The frame is admitted, but the previous one is being read: a later call publishes it.
   */
  DIBS_ADVANCE_HELD = 2,
  /**
   * The frame is published.
   */
  DIBS_ADVANCE_PUBLISHED = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum dibs_advance dibs_advance;
#else
typedef uint32_t dibs_advance;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Which rule a force comes from.
 */
enum dibs_force_state
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * The tool is outside the margin: no force.
   */
  DIBS_FORCE_STATE_INACTIVE = 0,
  /**
   * The wall acts.
   */
  DIBS_FORCE_STATE_ACTIVE = 1,
  /**
   * The wall acts with its largest force.
   */
  DIBS_FORCE_STATE_SATURATED = 2,
  /**
   * The answer cannot be used: the force is the hold, pure damping.
   */
  DIBS_FORCE_STATE_SAFE = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum dibs_force_state dibs_force_state;
#else
typedef uint32_t dibs_force_state;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Why a motion was admitted. All but the last are safe.
 */
enum dibs_reason
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * It is the commanded motion.
   */
  DIBS_REASON_COMMANDED = 0,
  /**
   * It is the closest motion that walls, the caller's rows and the robot's speed allow.
   */
  DIBS_REASON_NEAREST = 1,
  /**
   * It is half of that motion, or less: no more could be verified.
   */
  DIBS_REASON_SHORTENED = 2,
  /**
   * No motion could be verified: it is zero.
   */
  DIBS_REASON_STOPPED = 3,
  /**
   * The surface approaches: it is the smallest motion that keeps the stand-off.
   */
  DIBS_REASON_RETREATING = 4,
  /**
   * No motion was found that certainly keeps the stand-off. It is the best known one.
   */
  DIBS_REASON_NO_SAFE_MOTION = 5,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum dibs_reason dibs_reason;
#else
typedef uint32_t dibs_reason;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The side of the surface on which a tool's axis is.
 */
enum dibs_side
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Outside: from there the triangles' corners appear counter-clockwise.
   */
  DIBS_SIDE_OUTSIDE = 0,
  /**
   * The whole axis is inside.
   */
  DIBS_SIDE_INSIDE = 1,
  /**
   * The axis crosses the surface.
   */
  DIBS_SIDE_CROSSING = 2,
  /**
   * No side: not requested.
   */
  DIBS_SIDE_NOT_ASKED = 3,
  /**
   * No side: the tree has no adjacency.
   */
  DIBS_SIDE_NO_ADJACENCY = 4,
  /**
   * No side: the closest point is on an open boundary of the surface.
   */
  DIBS_SIDE_OPEN_BOUNDARY = 5,
  /**
   * No side: the axis is closer to the surface, or to a tie between its features, than the accuracy resolves.
   */
  DIBS_SIDE_BELOW_ACCURACY = 6,
  /**
   * No side: the triangles at the closest point have no clear normal.
   */
  DIBS_SIDE_DEGENERATE = 7,
  /**
   * No side: the budget ran out.
   */
  DIBS_SIDE_CUT_SHORT = 8,
  /**
   * No side: the closest point is on an edge of more than two triangles that do not form pairs.
   */
  DIBS_SIDE_NON_MANIFOLD = 9,
  /**
   * Of a tracker's kept answer: outside or not, its interval holds the separation.
   */
  DIBS_SIDE_EITHER = 10,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum dibs_side dibs_side;
#else
typedef uint32_t dibs_side;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * How it is known that the tree's spheres cover the surface, so that no part of it is nearer than the answer.
 */
enum dibs_coverage
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * The stretch was measured on these positions.
   */
  DIBS_COVERAGE_MEASURED = 0,
  /**
   * A bound on the stretch follows from measured frames.
   */
  DIBS_COVERAGE_PROVEN = 1,
  /**
   * Nothing was measured: the tree's stretch limit is assumed to hold. If it does not, a nearer part of the surface
   * can be missed.
   */
  DIBS_COVERAGE_ASSUMED = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum dibs_coverage dibs_coverage;
#else
typedef uint32_t dibs_coverage;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Trust in the surface.
 */
enum dibs_state
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Every input is within its limits.
   */
  DIBS_STATE_NOMINAL = 0,
  /**
   * The surface may be acted on, with a growing margin.
   */
  DIBS_STATE_DEGRADED = 1,
  /**
   * The surface must not be acted on.
   */
  DIBS_STATE_SAFE = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum dibs_state dibs_state;
#else
typedef uint32_t dibs_state;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * A processor and a kind of tool whose instructions were measured.
 */
enum dibs_cost
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * A sphere on a Cortex-M7.
   */
  DIBS_COST_M7_SPHERE = 0,
  /**
   * A capsule on a Cortex-M7.
   */
  DIBS_COST_M7_CAPSULE = 1,
  /**
   * A sphere on x86-64.
   */
  DIBS_COST_X86_SPHERE = 2,
  /**
   * A capsule on x86-64.
   */
  DIBS_COST_X86_CAPSULE = 3,
  /**
   * A tick of a tracker or guard on a Cortex-M7, with contacts or without.
   */
  DIBS_COST_M7_TICK = 4,
  /**
   * The same on a surface that nodes carry.
   */
  DIBS_COST_M7_NODES_TICK = 5,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum dibs_cost dibs_cost;
#else
typedef uint32_t dibs_cost;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Why a tick was a whole query.
 */
enum dibs_fallback
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * It was not a whole query.
   */
  DIBS_FALLBACK_NONE = 0,
  /**
   * It was the first tick, or the first after an error.
   */
  DIBS_FALLBACK_START = 1,
  /**
   * The surface's motion is not known without gaps.
   */
  DIBS_FALLBACK_SURFACE = 2,
  /**
   * Tool or surface moved too far.
   */
  DIBS_FALLBACK_JUMP = 3,
  /**
   * More nodes were opened than the tracker has room for.
   */
  DIBS_FALLBACK_FULL = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum dibs_fallback dibs_fallback;
#else
typedef uint32_t dibs_fallback;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * An account of the energy that a wall's force gives to the hand, relative to the wall. It limits the force's steps, and
 * reduces the force where the energy given would exceed the energy received by more than a stated tank. If the relative
 * velocity leaps outwards, the force falls in steps, and the wall gives more. At speeds up to the stated one, all this
 * together is at most `speed * period * (F + step / 2)^2 / (2 * step)` for the largest force `F`. An account that has
 * used it up recovers by a tenth of the tank per second, up to an eighth, so that the wall keeps a force.
 *
 * One context at a time.
 */
typedef struct dibs_account dibs_account;

/**
 * The bus's end of a guarded surface: it receives packets, checks complete frames in slices, publishes them, checks
 * the tree's bytes in the background, and writes the statuses for the sender.
 *
 * Two contexts may use it, one at a time: an interrupt that receives bytes, and an idle loop that checks. Both have a
 * lower priority than the control tick. The interrupt gets `DIBS_CODE_IN_USE` while the loop uses the bus: it then
 * keeps its bytes for later, or the loop masks the interrupt while it works.
 */
typedef struct dibs_bus dibs_bus;

/**
 * A list of contacts.
 *
 * One context at a time.
 */
typedef struct dibs_contacts dibs_contacts;

/**
 * The machine. It starts in the safe state.
 *
 * One context at a time.
 */
typedef struct dibs_failsafe dibs_failsafe;

/**
 * The surface at one moment: the caller's vertices, or the frame that a reader holds. Queries search it.
 *
 * One context at a time.
 */
typedef struct dibs_frame dibs_frame;

/**
 * The control tick's end of a guarded surface: it finds the closest pair of one tool and the present surface, and
 * decides whether to trust the surface.
 *
 * One context at a time: the control interrupt, of higher priority than the bus's.
 */
typedef struct dibs_guard dibs_guard;

/**
 * A query on one tree. It starts its search from its last answer.
 *
 * One context at a time.
 */
typedef struct dibs_query dibs_query;

/**
 * Reads the latest published frame.
 *
 * One context at a time: the control interrupt.
 */
typedef struct dibs_reader dibs_reader;

/**
 * Assembles frames from packets, checks them, and publishes those that are complete and valid.
 *
 * One context at a time, of lower priority than the reader's: the bus interrupt.
 */
typedef struct dibs_receiver dibs_receiver;

/**
 * A background check of a tree's bytes: flash that is corrupted after start-up gives wrong answers without an error.
 *
 * One context at a time.
 */
typedef struct dibs_scrub dibs_scrub;

/**
 * Sends the frames of a moving surface to a controller, and receives statuses.
 *
 * Only in the library for a host computer. Its calls wait for the line, so they do not belong in a control loop.
 * Unlike the other objects it allocates when it starts, and has a thread that reads the line: `dibs_sender_close` ends
 * both. Another `dibs_sender_init` in the same storage without it leaks them.
 */
typedef struct dibs_sender dibs_sender;

/**
 * Two buffers of vertices: one end fills one while the other end reads the other, and neither waits. With a third
 * buffer the previous frame is kept, from which a guard extrapolates.
 *
 * Any number of contexts may use it at once.
 */
typedef struct dibs_surface dibs_surface;

/**
 * The tags that a receiver demands of every packet, and writes into every status: AES-128-CMAC under a key that both
 * ends have. `docs/wire.md` says what they protect against.
 *
 * Any number of contexts may use it at once.
 */
typedef struct dibs_tags dibs_tags;

/**
 * A query that remembers the proof of its last answer.
 *
 * It keeps a copy of the surface, so that a frame is only held while it is copied; or it searches a reader's frame
 * directly. One context at a time.
 */
typedef struct dibs_tracker dibs_tracker;

/**
 * A validated tree, such as `heart.dibs` from `dibs build heart.ply -o heart.dibs`. At most 65,536 vertices; the
 * library that `cargo build -p dibs-c --features large` makes takes larger trees instead.
 *
 * Any number of contexts may use it at once.
 */
typedef struct dibs_tree dibs_tree;

/**
 * Publishes frames of the caller's positions, for a reader of the same surface.
 *
 * A frame is one `dibs_writer_begin`, any number of `dibs_writer_push`, and one `dibs_writer_publish`. Only the
 * stretch is checked: frames that arrive over a line belong to a receiver. One context at a time.
 */
typedef struct dibs_writer dibs_writer;

/**
 * A point, a direction, a force or a velocity.
 */
typedef struct {
  /**
   * Along x.
   */
  float x;
  /**
   * Along y.
   */
  float y;
  /**
   * Along z.
   */
  float z;
} dibs_vec3;

/**
 * Options of a query. Null for none: no budget, a warm start, signed.
 */
typedef struct {
  /**
   * The most work, in tests of spheres and planes, where an exact triangle test counts as 8:
   * `dibs_budget_for_instructions`. 0 allows next to no work, so set it.
   */
  uint32_t budget;
  /**
   * Largest length (mm) of the interval of a depth if the tool's axis crosses the surface; 0 for a 512th of the
   * axis' length.
   */
  float depth_tolerance;
  /**
   * Any sum of `DIBS_COLD`, `DIBS_UNSIGNED` and `DIBS_CONTACTS_OF`.
   */
  uint32_t flags;
  /**
   * A triangle's label, for `DIBS_CONTACTS_OF`: at most 255.
   */
  uint32_t label;
} dibs_options;

/**
 * Two limits on one input: above the first the state is degraded, above the second safe. Both `DIBS_UNLIMITED` if the
 * input has no limits; otherwise below 2^31.
 */
typedef struct {
  /**
   * The first limit.
   */
  uint32_t degraded;
  /**
   * The second limit, at least the first.
   */
  uint32_t safe;
} dibs_watch;

/**
 * The machine's limits. Times are in ms.
 */
typedef struct {
  /**
   * Age of the surface; must have limits.
   */
  dibs_watch age;
  /**
   * Time since any good packet.
   */
  dibs_watch silence;
  /**
   * Time since the last heartbeat.
   */
  dibs_watch heartbeat;
  /**
   * Frames refused or abandoned since the last one was published.
   */
  dibs_watch rejections;
  /**
   * Transit time of the published frame. With `DIBS_UNLIMITED` it has no limit, and is covered by the margin.
   */
  dibs_watch transit;
  /**
   * Age of the published frame when it was sent; a safe limit is below 65,534.
   */
  dibs_watch source_age;
  /**
   * Forged packets, minus 10 for each second; the limits are below 1,000.
   */
  dibs_watch forgeries;
  /**
   * Largest speed of any point of the tissue, in mm per ms (m/s); at least 0.
   */
  float tissue_speed;
  /**
   * Consecutive good frames that recover: 1 to 65,535.
   */
  uint32_t recovery_frames;
  /**
   * Consecutive steps with every input within its first limit, before recovery.
   */
  uint32_t dwell;
  /**
   * Other than 0 to omit the transit time from the margin and the limits: a delay is then not detected.
   */
  uint32_t without_transit;
  /**
   * 0 to leave the safe state only by an acknowledgement; otherwise automatically.
   */
  uint32_t automatic;
} dibs_limits;

/**
 * Limits of a surface in addition to the tree's stretch limit. A limit that is NaN refuses every frame.
 */
typedef struct {
  /**
   * Largest magnitude (mm) of a coordinate. The smaller it is, the more damage it detects.
   */
  float reach;
  /**
   * Largest speed of a vertex, in mm per ms (m/s); `INFINITY` for no limit.
   */
  float speed;
  /**
   * Least size of a region relative to its size at rest, 0.25 for example; 0 for no limit.
   */
  float shrinkage;
  /**
   * Largest displacement (mm) of a vertex from its position in the published frame, however long ago that was; 0 for
   * a tenth of the reach, `INFINITY` for no limit.
   */
  float recovery;
} dibs_surface_limits;

/**
 * Limits on the trust in a surface, and options of a tick's query. `dibs_guard_limits_of` makes one from two numbers.
 */
typedef struct {
  /**
   * Largest speed (mm/s) of any point of the tissue, at least 0.
   */
  float speed;
  /**
   * Largest age (ms) of a surface: about two periods of the source plus the transit time. From three quarters of it
   * on the state is degraded, above it safe.
   */
  uint32_t age;
  /**
   * Ticks of the control loop a second, above 0: needed for velocities.
   */
  uint32_t ticks_a_second;
  /**
   * Options of every tick's query; the budget limits the work of a tick.
   */
  dibs_options options;
  /**
   * 0 to leave the safe state only by an acknowledgement; otherwise automatically.
   */
  uint32_t automatic;
  /**
   * Other than 0 for a line that returns no status: a delayed frame is then taken for a new one, and no margin
   * covers the delay.
   */
  uint32_t without_transit;
  /**
   * The fail-safe machine's limits; or null to derive them from the numbers above.
   */
  const dibs_limits *trust;
  /**
   * The published surfaces' limits; or null to derive them from the speed and the tree's rest shape: a reach of four
   * times its size.
   */
  const dibs_surface_limits *surfaces;
} dibs_guard_limits;

/**
 * State of a bus.
 */
typedef struct {
  /**
   * 0 before the first frame; the epoch is then 0 as well.
   */
  uint32_t is_published;
  /**
   * Number of the latest published frame; wraps.
   */
  uint32_t epoch;
  /**
   * Completed rounds of the check of the tree's bytes; wraps.
   */
  uint32_t rounds;
} dibs_bus_facts;

/**
 * A wall: a margin around the surface, with a spring and a damper.
 *
 * A sampled wall is passive only if the device's own damping is above `stiffness * tick / 2 + damping`.
 */
typedef struct {
  /**
   * In N/mm, above 0.
   */
  float stiffness;
  /**
   * In N s/mm, at least 0.
   */
  float damping;
  /**
   * Damping (N s/mm, at least 0) if there is no answer to act on; 0 releases the tool.
   */
  float hold_damping;
  /**
   * In N, above 0.
   */
  float max_force;
  /**
   * Distance from the surface at which the wall begins (mm, above 0).
   */
  float margin;
} dibs_wall;

/**
 * The closest pair. `dibs_proximity_interval` gives the interval that contains its separation.
 *
 * If the side is none of the first three, the numbers are those of a tool outside.
 */
typedef struct {
  /**
   * Signed separation (mm) of the best pair found: negative if tool and surface overlap.
   */
  float separation;
  /**
   * The interval's lower bound (mm): equal to `separation`, unless the budget ran out or the axis crosses the
   * surface.
   */
  float lower;
  /**
   * Largest error (mm) of the separations above.
   */
  float accuracy;
  /**
   * A `dibs_side`.
   */
  uint32_t side;
  /**
   * A `dibs_coverage`: whether the stretch that the answer depends on was checked.
   */
  uint32_t coverage;
  /**
   * Distance (mm) from the tool's axis to the surface: 0 if they cross.
   */
  float axis_distance;
  /**
   * The surface's point of the pair (mm).
   */
  dibs_vec3 point_on_surface;
  /**
   * The tool's point of the pair, on the tool's surface (mm).
   */
  dibs_vec3 point_on_tool;
  /**
   * Unit vector that points out of the surface; zero if it is undefined.
   */
  dibs_vec3 direction;
  /**
   * Position of the pair along the tool's axis: 0 at its start, 1 at its end; 0 for a sphere.
   */
  float axis_parameter;
  /**
   * Row of the triangle of `point_on_surface`, or `DIBS_NO_TRIANGLE`.
   */
  uint32_t triangle;
  /**
   * That triangle's corners: rows of vertices, for `dibs_tree_vertex_number`.
   */
  uint32_t corners[3];
  /**
   * Weights of the corners at `point_on_surface`: not negative, sum 1.
   */
  float barycentric[3];
  /**
   * Sphere bounds evaluated.
   */
  uint32_t node_tests;
  /**
   * Exact tests of tool and triangle.
   */
  uint32_t triangle_tests;
} dibs_proximity;

/**
 * A force and a torque on the tool.
 */
typedef struct {
  /**
   * In N. Always finite.
   */
  dibs_vec3 force;
  /**
   * In N mm, about the given point. Always finite; zero for a single pair.
   */
  dibs_vec3 torque;
  /**
   * Which rule they come from.
   */
  dibs_force_state state;
  /**
   * The cause of a hold; otherwise `DIBS_CODE_OK`.
   */
  dibs_code cause;
} dibs_force;

/**
 * A rigid instrument: all points within `radius` of the segment from `start` to `end`, in the mesh's coordinates (mm).
 * A capsule; a sphere if both ends are equal.
 */
typedef struct {
  /**
   * One end of the axis (mm): at most 2^29 on each axis.
   */
  dibs_vec3 start;
  /**
   * The other end (mm).
   */
  dibs_vec3 end;
  /**
   * Radius (mm): 0 to 2^29.
   */
  float radius;
} dibs_tool;

/**
 * Properties of a list.
 */
typedef struct {
  /**
   * Contacts in the list.
   */
  uint32_t count;
  /**
   * Every contact with a separation below this (mm) is in the list.
   */
  float bound;
  /**
   * No separation is too high by more than this (mm).
   */
  float accuracy;
  /**
   * 1 if contacts within the margin were left out because the list is full; else 0.
   */
  uint32_t is_full;
} dibs_contacts_facts;

/**
 * A locally closest pair of tool and surface.
 */
typedef struct {
  /**
   * Signed separation (mm): the lower bound of the pair's interval, as `lower` of `dibs_proximity`.
   */
  float separation;
  /**
   * Unit vector that points out of the surface.
   */
  dibs_vec3 normal;
  /**
   * The surface's point (mm).
   */
  dibs_vec3 point_on_surface;
  /**
   * The tool's point (mm).
   */
  dibs_vec3 point_on_tool;
  /**
   * Position of the pair along the tool's axis: 0 at its start, 1 at its end.
   */
  float axis_parameter;
  /**
   * Index of the surface in a scene; 0 for a single surface.
   */
  uint32_t surface;
  /**
   * Index of the tool in a chain; 0 for a single tool.
   */
  uint32_t tool;
  /**
   * Row of the triangle.
   */
  uint32_t triangle;
  /**
   * That triangle's corners: rows of vertices, for `dibs_tree_vertex_number`.
   */
  uint32_t corners[3];
  /**
   * Weights of the corners at `point_on_surface`.
   */
  float barycentric[3];
  /**
   * Velocity (mm/s) of the surface at the contact: zero until `dibs_contacts_set_velocities`; a guard's list has it.
   */
  dibs_vec3 velocity;
} dibs_contact;

/**
 * One inequality on the tool's velocity: `linear . v + angular . w >= least`, with the velocity `v` (mm/s) of a point of
 * the tool and the tool's angular velocity `w` (1/s). For any solver of quadratic programs.
 */
typedef struct {
  /**
   * Factors of the linear velocity: the contact's normal; if the deepest point is inside the tool's axis, the mean
   * of two triangles' normals.
   */
  float linear[3];
  /**
   * Factors (mm) of the angular velocity.
   */
  float angular[3];
  /**
   * Lower bound of the sum (mm/s).
   */
  float least;
} dibs_row;

/**
 * The latest published frame, and its age.
 */
typedef struct {
  /**
   * 0 before the first frame; all other fields are then 0 as well.
   */
  uint32_t is_published;
  /**
   * Number of the frame; wraps.
   */
  uint32_t epoch;
  /**
   * Arrival of its first packet, on the receiver's clock; wraps.
   */
  uint32_t received;
  /**
   * Time since then, in the clock's unit.
   */
  uint32_t age;
} dibs_age;

/**
 * The health of the bus. Times in ms, `UINT32_MAX` if unknown.
 */
typedef struct {
  /**
   * Time since the last good packet.
   */
  uint32_t silence;
  /**
   * Time since the last heartbeat.
   */
  uint32_t heartbeat;
  /**
   * Frames refused or abandoned since the last one was published.
   */
  uint32_t rejections;
  /**
   * Packets without an authentic tag, minus 10 for each second.
   */
  uint32_t forgeries;
  /**
   * Upper bound on the transit time of the published frame.
   */
  uint32_t transit;
  /**
   * Age of the published frame when it was sent.
   */
  uint32_t source_age;
} dibs_link;

/**
 * The input of a step.
 */
typedef struct {
  /**
   * The published frame and its age, from `dibs_reader_latest`.
   */
  dibs_age age;
  /**
   * The bus's health, from `dibs_reader_link`.
   */
  dibs_link link;
  /**
   * Code of the query on that frame: `DIBS_CODE_OK` if it gave an answer, or there was no query.
   */
  uint32_t query;
  /**
   * Other than 0 once `dibs_scrub_step` has found the tree's bytes changed. Leave it set.
   */
  uint32_t is_tree_corrupt;
} dibs_observation;

/**
 * The result of a step.
 */
typedef struct {
  /**
   * A `dibs_state`.
   */
  uint32_t state;
  /**
   * Cause of a state that is not nominal: a `dibs_code`.
   */
  uint32_t cause;
  /**
   * Largest motion of the tissue (mm) in the surface's age and transit time.
   */
  float margin;
  /**
   * 1 if only an acknowledgement is missing to leave the safe state; else 0.
   */
  uint32_t waits_for_acknowledgement;
} dibs_verdict;

/**
 * A larger stand-off, from the triangles of a label.
 */
typedef struct {
  /**
   * At most 255.
   */
  uint32_t label;
  /**
   * Least separation (mm) of every tool from these triangles; at least the filter's.
   */
  float stand_off;
} dibs_stand_off_of;

/**
 * A filter of commands. `dibs_filter_of` makes one from two numbers.
 */
typedef struct {
  /**
   * Least separation (mm) of every tool from the tissue, at least 0.
   */
  float stand_off;
  /**
   * Largest speed (mm/s) of the robot's reference point, and of the lever arm's end in a rotation; above 0.
   */
  float speed;
  /**
   * Lever arm: a rotation by one radian counts as a translation by this length (mm), at least 1; 0 for the distance
   * from the reference point to the farthest end of a tool's axis.
   */
  float lever;
  /**
   * A tool approaches its stand-off no faster than its distance from it divided by this time (s), at least 0; 0 for
   * no such limit.
   */
  float approach;
  /**
   * Most instructions of a tick, searches, rows and all, by `cost`.
   */
  uint32_t instructions;
  /**
   * `DIBS_COST_M7_TICK`, which is `DIBS_COST_M7_NODES_TICK` for a tree with nodes; not a query's.
   */
  uint32_t cost;
  /**
   * As in `dibs_options`.
   */
  float depth_tolerance;
  /**
   * Labels with a stand-off of their own: at most `DIBS_FILTER_LABELS`. Each stand-off above the filter's counts as one
   * more tool for every tool, up to `DIBS_FILTER_TOOLS` in all, and a triangle must have that label.
   */
  uint32_t label_count;
  /**
   * Those labels.
   */
  dibs_stand_off_of labels[DIBS_FILTER_LABELS];
} dibs_filter;

/**
 * The motion of a rigid instrument in a period: its reference point moves in a straight line, and the instrument
 * rotates about it.
 */
typedef struct {
  /**
   * The reference point before the motion (mm).
   */
  dibs_vec3 about;
  /**
   * The reference point's displacement (mm).
   */
  dibs_vec3 translation;
  /**
   * The rotation vector: the axis, times the angle in radians. A filter admits half a radian at most.
   */
  dibs_vec3 rotation;
} dibs_rigid_motion;

/**
 * How far the tissue may be from the searched surface, in addition to that surface's own position error.
 */
typedef struct {
  /**
   * At the start of the period (mm, at least 0): the tissue's speed times age and transit time, plus the error of
   * registration.
   */
  float now;
  /**
   * Largest speed (mm/s, at least 0) of the tissue in the period.
   */
  float speed;
} dibs_uncertainty;

/**
 * An inequality on the motion: `linear . translation + angular . rotation >= least`. For limits that only the caller
 * knows: joints, a remote centre of motion, a guide. They take precedence over the walls.
 */
typedef struct {
  /**
   * Factors of the translation.
   */
  float linear[3];
  /**
   * Factors (mm) of the rotation.
   */
  float angular[3];
  /**
   * Lower bound of the sum (mm).
   */
  float least;
} dibs_motion_row;

/**
 * The motion that a filter admits.
 */
typedef struct {
  /**
   * The motion to execute.
   */
  dibs_rigid_motion motion;
  /**
   * At no instant of the period the separation (mm) of any tool is less, as long as the tissue is within its
   * uncertainty.
   */
  float least_separation;
  /**
   * Why this motion was chosen.
   */
  dibs_reason reason;
  /**
   * Number of queries.
   */
  uint32_t queries;
  /**
   * Instructions of the tick, by the filter's cost model.
   */
  uint32_t instructions;
} dibs_admitted_motion;

/**
 * Properties of a frame.
 */
typedef struct {
  /**
   * Number of vertices.
   */
  uint32_t vertices;
  /**
   * Largest error (mm) of a vertex position. Part of the accuracy of every answer.
   */
  float position_error;
  /**
   * The largest stretch, 1 for none; 0 if it was not measured.
   */
  float stretch;
} dibs_frame_facts;

/**
 * An interval of separations (mm).
 */
typedef struct {
  /**
   * Lower bound of the true separation.
   */
  float lower;
  /**
   * Upper bound of the true separation.
   */
  float upper;
} dibs_interval;

/**
 * The answer of a tick, from one tracker or several.
 */
typedef struct {
  /**
   * The closest pair; its counts of tests are this tick's. For several pairs its interval starts at the least lower
   * bound of all, its accuracy is the worst, its tests are those of all, and its side is `DIBS_SIDE_CUT_SHORT` if
   * the budget ended before the side of any pair was known.
   */
  dibs_proximity proximity;
  /**
   * Other than 0 if this tick's search found no side, because its budget ended or the side is undefined: the side is
   * then the last tick's, if the motion since allows that. The pair may then not be the closest; the interval is
   * still valid.
   */
  uint32_t is_kept;
  /**
   * A `dibs_fallback`: the first reason for a whole query, among the pairs that were searched.
   */
  uint32_t fallback;
  /**
   * Upper bound (mm) on the motion of tool and surface together since the last tick; -1 if unknown, and for several
   * pairs.
   */
  float moved;
  /**
   * Opened nodes that the tracker remembers, of at most `DIBS_OPENED`.
   */
  uint32_t opened;
  /**
   * Index of the pair, if there are several; else 0.
   */
  uint32_t pair;
  /**
   * Number of pairs that were searched; the others were certain to be farther.
   */
  uint32_t searched;
} dibs_tracked;

/**
 * The surface that a tick searched.
 */
typedef struct {
  /**
   * A `dibs_code`: `DIBS_CODE_OK` if there is a pair; otherwise why there is none. Before the first surface all
   * other fields are 0, and the residual is -1.
   */
  uint32_t outcome;
  /**
   * The pair; NaN if there is none. Its accuracy covers the frame's error and the extrapolation's.
   */
  dibs_tracked tracked;
  /**
   * Number of the frame before the latest one; the same number if the surface is held at the latest frame.
   */
  uint32_t before;
  /**
   * Its time in frame intervals: 0 is the previous frame, 1 the latest one, 3 the end of the extrapolation.
   */
  float t;
  /**
   * Error (mm) of each position, including that of the extrapolation.
   */
  float position_error;
  /**
   * The distance (mm) of recent frames from their extrapolation; -1 if the surface is held at the latest frame.
   */
  float residual;
  /**
   * Its velocity (mm/s) at the pair: from one frame to the next, zero if the surface is held.
   */
  dibs_vec3 velocity;
} dibs_searched_surface;

/**
 * The answer of a tick: the pair that a wall may act on, and how it was found.
 */
typedef struct {
  /**
   * A `dibs_code`: `DIBS_CODE_OK` if there is a pair to act on; otherwise why there is none.
   */
  uint32_t outcome;
  /**
   * The closest pair to act on; NaN if there is none. Its accuracy covers the frame's error, the extrapolation's
   * error, and the tissue's motion during the surface's lag. If its side is unknown, it is the last pair whose side
   * was known.
   */
  dibs_proximity closest;
  /**
   * Its certified interval: act on the lower bound. From minus to plus infinity if there is no pair.
   */
  dibs_interval interval;
  /**
   * Velocity (mm/s) of the tool's point of the pair relative to the surface's; without a pair that of the middle of
   * the axis. Zero at the first tick, NaN without a tool.
   */
  dibs_vec3 velocity;
  /**
   * The trust in the surface: state, cause, margin.
   */
  dibs_verdict trust;
  /**
   * The frame that was searched, and its age.
   */
  dibs_age age;
  /**
   * Time (ms) by which the searched surface lags behind the present, as far as its error does not cover it;
   * `UINT32_MAX` if unknown.
   */
  uint32_t lag;
  /**
   * The health of the bus.
   */
  dibs_link link;
  /**
   * The searched surface, and the pair on it, trusted or not: for records.
   */
  dibs_searched_surface searched;
} dibs_answer;

/**
 * A rigid pose of a mesh: its point `p` is at `rotation p + shift`.
 */
typedef struct {
  /**
   * A quaternion x, y, z, w; the square of its length is within 2^-20 of 1.
   */
  float rotation[4];
  /**
   * In mm.
   */
  dibs_vec3 shift;
} dibs_pose;

/**
 * A chain of tools whose axes touch each other, and the surfaces around it. A chain and one surface are a scene as
 * well.
 */
typedef struct {
  /**
   * Addresses of queries, one for each surface, on the surface's tree. No query may be listed twice.
   */
  dibs_query *const *queries;
  /**
   * Addresses of the surfaces' frames, in the same order. No frame may be listed twice.
   */
  dibs_frame *const *frames;
  /**
   * Number of surfaces: 1 to `DIBS_SURFACES`.
   */
  uint32_t surface_count;
  /**
   * The chain's tools.
   */
  const dibs_tool *tools;
  /**
   * Number of tools: 1 to `DIBS_TOOLS`.
   */
  uint32_t tool_count;
} dibs_scene;

/**
 * The closest pair of a scene.
 */
typedef struct {
  /**
   * Index of the surface in the scene.
   */
  uint32_t surface;
  /**
   * Index of the tool in the chain.
   */
  uint32_t tool;
  /**
   * The pair. Its interval starts at the least lower bound of all pairs, its accuracy is the worst, and its tests
   * are those of all pairs. Its side is `DIBS_SIDE_CUT_SHORT` if the budget ended before the side of any pair was
   * known.
   */
  dibs_proximity proximity;
} dibs_closest;

/**
 * Settings of a sender. `dibs_sender_settings_of` returns the defaults.
 */
typedef struct {
  /**
   * Other than 0 for 6 bytes a vertex instead of 12, in a box that is fitted to each frame.
   */
  uint32_t quantised;
  /**
   * Sends only the vertices that moved by more than this (mm); below 0 every frame is whole.
   */
  float partial;
  /**
   * With partial frames, the largest number of frames from one whole frame to the next.
   */
  uint32_t whole_every;
  /**
   * Time between two heartbeats, in ms; 0 sends none.
   */
  uint32_t heartbeat;
  /**
   * Session number of this sender. The receiver ignores packets of earlier sessions, whose numbers are smaller, so a
   * program that restarts needs a larger one. By default the time in tenths of a second.
   */
  uint32_t session;
} dibs_sender_settings;

/**
 * A frame that was sent.
 */
typedef struct {
  /**
   * Its number.
   */
  uint32_t epoch;
  /**
   * 0 for a whole frame.
   */
  uint32_t is_partial;
  /**
   * Number of rows in it.
   */
  uint32_t rows;
  /**
   * Number of its packets.
   */
  uint32_t packets;
  /**
   * Bytes of its packets, without the framing of a serial line.
   */
  uint32_t bytes;
  /**
   * Largest distance (mm) of a vertex from its position at the receiver.
   */
  float error;
} dibs_sent_frame;

/**
 * State of a sender.
 */
typedef struct {
  /**
   * Frames sent since the start.
   */
  uint32_t frames;
  /**
   * Statuses received.
   */
  uint32_t statuses;
  /**
   * Frames that the receiver has not acknowledged.
   */
  uint32_t in_flight;
  /**
   * 0 until the receiver has published a frame of this sender; `acknowledged` is then 0 as well.
   */
  uint32_t is_acknowledged;
  /**
   * Number of the latest acknowledged frame.
   */
  uint32_t acknowledged;
  /**
   * Whether frames can be sent: without a key always, with a key once the receiver's challenge is known.
   */
  uint32_t is_ready;
} dibs_sender_facts;

/**
 * The motion of tool and surface from one tick to the next: the ends of the tool's axis and the surface's vertices
 * each move linearly.
 */
typedef struct {
  /**
   * The tool at the start.
   */
  dibs_tool from;
  /**
   * The tool at the end. Between them it has the larger of their radii.
   */
  dibs_tool to;
  /**
   * The surface at the start and at the end: 0 is the tracker's surface before the last `dibs_tracker_set_frame`, 1
   * the one since then.
   */
  float t[2];
  /**
   * In mm, not negative.
   */
  float margin;
  /**
   * Largest number of queries; at least 1 is made, which is usually enough.
   */
  uint32_t samples;
} dibs_sweep;

/**
 * The result of a sweep. Times are fractions of the sweep: 0 is its start, 1 its end.
 */
typedef struct {
  /**
   * Before this time they are certainly not closer than the margin; 1 or more: during the whole sweep.
   */
  float clear_until;
  /**
   * The first time at which they were found within the margin, or farther by no more than the accuracy; -1 for none.
   * With none and `clear_until` below 1 the samples were too few to decide.
   */
  float contact;
  /**
   * The closest pair at the end.
   */
  dibs_proximity at_end;
  /**
   * Queries made.
   */
  uint32_t samples;
} dibs_swept;

/**
 * Properties of a tree.
 */
typedef struct {
  /**
   * Vertices.
   */
  uint32_t vertices;
  /**
   * Rows of a frame: the nodes that move the surface if the tree has any (`dibs build --nodes`), else its vertices.
   */
  uint32_t rows;
  /**
   * Triangles.
   */
  uint32_t triangles;
  /**
   * Nodes of the tree of spheres.
   */
  uint32_t nodes;
  /**
   * Identity of the mesh, which packets carry.
   */
  uint32_t mesh_id;
  /**
   * Checksum of the tree's bytes.
   */
  uint32_t checksum;
  /**
   * The stretch limit that the tree was built for; 1 for no stretch.
   */
  float stretch;
  /**
   * Largest distance (mm) of a vertex from its position in the mesh's file.
   */
  float position_error;
  /**
   * Vertices of the mesh's file, including those of no triangle: positions of a frame in the file's order.
   */
  uint32_t file_vertices;
  /**
   * Triangles of the mesh's file, including those that the builder dropped.
   */
  uint32_t file_triangles;
  /**
   * Unit of the mesh's file: 0 unknown, 1 mm, 2 cm, 3 m, 4 inch, 5 micrometre. All lengths of the tree are in mm.
   */
  uint8_t unit;
} dibs_tree_facts;

/**
 * A point of the mesh's file (mm), in double precision.
 */
typedef struct {
  /**
   * Along the first axis.
   */
  double x;
  /**
   * Along the second axis.
   */
  double y;
  /**
   * Along the third axis.
   */
  double z;
} dibs_point;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Makes an account with a full tank.
 *
 * @param storage    `DIBS_ACCOUNT_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
 * @param size       Bytes of the storage.
 * @param tank       Energy (mJ) that may be given beyond the energy received, above 0.
 * @param step       Largest change of the force per tick (N), above 0.
 * @param stiffness  Stiffness of the wall (N/mm), above 0.
 * @param max_force  Largest force of the wall (N), above 0.
 * @param speed      Largest speed (mm/s) of the tool relative to the wall, above 0. Of a faster motion only this speed
 *                   is counted.
 * @param account    Receives the account's address.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_GAIN`, or a misuse.
 */
dibs_code dibs_account_init(void *storage,
                            size_t size,
                            float tank,
                            float step,
                            float stiffness,
                            float max_force,
                            float speed,
                            dibs_account **account);

/**
 * The force to apply for the next period, for the force that `dibs_wall_force`, `dibs_wall_proxy_force` or
 * `dibs_answer_force` computed. Call it at every tick, during a hold too.
 *
 * If a number or its square is not finite, the force falls to zero in steps; a velocity that is not counts as one
 * along the force at the largest speed.
 *
 * @param account   The account.
 * @param force     The computed force (N).
 * @param velocity  Velocity (mm/s) of the tool relative to the wall since the last tick, as for the wall's force.
 * @param period    The period, in s.
 * @param applied   Receives the force to apply (N); always finite. May be the computed one's memory.
 * @return `DIBS_CODE_OK`, or a misuse.
 */
dibs_code dibs_account_pass(dibs_account *account,
                            dibs_vec3 force,
                            dibs_vec3 velocity,
                            float period,
                            dibs_vec3 *applied);

/**
 * The energy (mJ) that may still be given; below 0 after an overdraft.
 *
 * @param account  The account.
 * @param balance  Receives it.
 * @return `DIBS_CODE_OK`, or a misuse.
 */
dibs_code dibs_account_balance(dibs_account *account, float *balance);

/**
 * Makes the bus's end of a surface, once. `dibs_start` makes it together with all other objects.
 *
 * @param storage  `DIBS_BUS_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
 * @param size     Bytes of the storage.
 * @param surface  The surface, in `DIBS_GUARDED_SIZE(vertices)` bytes.
 * @param tree     Its tree.
 * @param limits   The guard's limits: the same as for `dibs_guard_init`.
 * @param bus      Receives the bus's address.
 * @return `DIBS_CODE_OK`; `DIBS_CODE_OTHER_TREE` if the surface's number of rows is not the tree's;
 *         `DIBS_CODE_STORAGE_SIZE` also if the surface has only two buffers; `DIBS_CODE_TAKEN` if its end was taken;
 *         `DIBS_CODE_TREE_NO_METRIC`; `DIBS_CODE_TREE_NO_REST_SHAPE` if the limits need one; or a misuse.
 */
dibs_code dibs_bus_init(void *storage,
                        size_t size,
                        dibs_surface *surface,
                        dibs_tree *tree,
                        const dibs_guard_limits *limits,
                        dibs_bus **bus);

/**
 * The same, for a sender with a key: a packet without a genuine tag is refused and counted.
 *
 * @param storage  As for `dibs_bus_init`.
 * @param size     Bytes of the storage.
 * @param surface  The surface.
 * @param tree     Its tree.
 * @param limits   The guard's limits.
 * @param tags     The tags.
 * @param bus      Receives the bus's address.
 * @return As `dibs_bus_init`.
 */
dibs_code dibs_bus_init_with_tags(void *storage,
                                  size_t size,
                                  dibs_surface *surface,
                                  dibs_tree *tree,
                                  const dibs_guard_limits *limits,
                                  dibs_tags *tags,
                                  dibs_bus **bus);

/**
 * Receives bytes from a serial line or another stream. `dibs_bus_counters` counts the outcomes by cause.
 *
 * Cost: linear in the bytes. `dibs_bus_work` must keep up: a complete frame is dropped if the next one begins before
 * it was checked.
 *
 * @param bus     The bus.
 * @param bytes   The bytes, read during the call.
 * @param length  Their number.
 * @param now     The receiver's clock, in ms; wraps.
 * @return `DIBS_CODE_OK`, or a misuse.
 */
dibs_code dibs_bus_receive(dibs_bus *bus,
                           const uint8_t *bytes,
                           size_t length,
                           uint32_t now);

/**
 * Receives one packet, from a bus that preserves packet boundaries.
 *
 * Cost: linear in the bytes.
 *
 * @param bus       The bus.
 * @param packet    The packet, read during the call.
 * @param length    Its bytes.
 * @param now       The receiver's clock, in ms; wraps.
 * @param progress  Receives its outcome, or null.
 * @return As `dibs_receiver_accept`.
 */
dibs_code dibs_bus_packet(dibs_bus *bus,
                          const uint8_t *packet,
                          size_t length,
                          uint32_t now,
                          dibs_progress *progress);

/**
 * Does a slice of the checks: checks some rows and triangles of the arriving frame, and publishes it once it is
 * complete and admitted. Without a frame it checks the tree's bytes.
 *
 * Cost: linear in `work`.
 *
 * @param bus      The bus.
 * @param work     Most rows and triangles that are checked.
 * @param advance  Receives the outcome, `DIBS_ADVANCE_PENDING` if more work is due at once; or null.
 * @return As `dibs_receiver_advance`.
 */
dibs_code dibs_bus_work(dibs_bus *bus,
                        uint32_t work,
                        dibs_advance *advance);

/**
 * Writes the status for the sender, if one is due. The sender's next frame echoes it, which measures the transit time
 * of frames. Call it after each slice of work: a status is due if there is news, or 100 ms have passed.
 *
 * @param bus       The bus.
 * @param now       The receiver's clock, in ms.
 * @param framed    0 for a packet; otherwise a COBS frame with the zero that ends it, for a stream.
 * @param out       Receives the status.
 * @param capacity  Size of `out` in bytes: at least `DIBS_STATUS`.
 * @param length    Receives the status's length; 0 if none is due.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_CAPACITY`, or a misuse.
 */
dibs_code dibs_bus_status(dibs_bus *bus,
                          uint32_t now,
                          uint32_t framed,
                          uint8_t *out,
                          size_t capacity,
                          size_t *length);

/**
 * The count of each event since the start, in the order of `dibs_event_name`.
 *
 * @param bus       The bus.
 * @param counters  Room for `DIBS_EVENTS` numbers.
 */
dibs_code dibs_bus_counters(dibs_bus *bus, uint32_t *counters);

/**
 * Reads the state of a bus.
 *
 * @param bus    The bus.
 * @param facts  Receives the state.
 */
dibs_code dibs_bus_get_facts(dibs_bus *bus, dibs_bus_facts *facts);

/**
 * Position (mm) of a vertex, or node, in the latest published frame, for a checksum of the published rows, or a log.
 *
 * @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` before the first frame, `DIBS_CODE_ARGUMENT` beyond the last vertex,
 *         or a misuse.
 */
dibs_code dibs_bus_position(dibs_bus *bus,
                            uint32_t vertex,
                            dibs_vec3 *position);

/**
 * Registers the surface again, as `dibs_receiver_register` does: only an operator may decide this.
 *
 * @return `DIBS_CODE_OK`, or a misuse.
 */
dibs_code dibs_bus_register(dibs_bus *bus);

/**
 * One sentence about a code, in English, without a full stop.
 *
 * Never null, even for a number that is not a code. The text is static.
 */
const char *dibs_code_text(uint32_t code);

/**
 * The force of a wall on the tool, from its closest pair.
 *
 * Call it at every tick, with the code of the call that returned the pair: with an error the force is the hold, pure
 * damping.
 *
 * @param wall       The wall.
 * @param outcome    The code of the query, of the fail-safe machine, or of the reader: the first one that was not
 *                   `DIBS_CODE_OK`.
 * @param proximity  The closest pair; not read, and may be null, if the outcome is an error.
 * @param velocity   Velocity (mm/s) of the tool's closest point relative to the surface.
 * @param force      Receives the force.
 * @return `DIBS_CODE_OK`, even if the force is the hold; `DIBS_CODE_GAIN`; or a misuse.
 */
dibs_code dibs_wall_force(const dibs_wall *wall,
                          uint32_t outcome,
                          const dibs_proximity *proximity,
                          dibs_vec3 velocity,
                          dibs_force *force);

/**
 * The force and the torque of a wall on the tool, from all its contacts: by a proxy that the contacts together keep
 * outside.
 *
 * @param wall      The wall. Its margin is at most that of the contacts.
 * @param outcome   As for `dibs_wall_force`.
 * @param contacts  The list.
 * @param origin    The tool's point (mm) that torque and velocity refer to.
 * @param velocity  Velocity (mm/s) of the tool at `origin`.
 * @param angular   Angular velocity (1/s) of the tool.
 * @param force     Receives force and torque.
 * @return `DIBS_CODE_OK`, even if the force is the hold; `DIBS_CODE_GAIN`; or a misuse.
 */
dibs_code dibs_wall_proxy_force(const dibs_wall *wall,
                                uint32_t outcome,
                                dibs_contacts *contacts,
                                dibs_vec3 origin,
                                dibs_vec3 velocity,
                                dibs_vec3 angular,
                                dibs_force *force);

/**
 * Makes an empty list of contacts.
 *
 * @param storage   `DIBS_CONTACTS_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
 * @param size      Bytes of the storage.
 * @param contacts  Receives the list's address.
 */
dibs_code dibs_contacts_init(void *storage, size_t size, dibs_contacts **contacts);

/**
 * Fills the list with all locally closest pairs whose separation is at most `margin`, deepest first.
 *
 * Cost: that of `dibs_query_closest`, a range search, and some hundred instructions a triangle within the margin.
 *
 * @param query      The query.
 * @param frame      The surface.
 * @param tool       The tool.
 * @param margin     In mm, at least 0.
 * @param options    Options, or null. A budget that runs out lowers the list's bound.
 * @param contacts   The list; empty after an error.
 * @param proximity  Receives the closest pair, or null.
 * @return As `dibs_query_closest`, `DIBS_CODE_MARGIN`, or `DIBS_CODE_TREE_NO_ADJACENCY`.
 */
dibs_code dibs_query_contacts(dibs_query *query,
                              dibs_frame *frame,
                              const dibs_tool *tool,
                              float margin,
                              const dibs_options *options,
                              dibs_contacts *contacts,
                              dibs_proximity *proximity);

/**
 * Reads the properties of the list.
 */
dibs_code dibs_contacts_get_facts(dibs_contacts *contacts, dibs_contacts_facts *facts);

/**
 * One contact of the list; number 0 is the deepest.
 *
 * @return `DIBS_CODE_OK`, `DIBS_CODE_ARGUMENT` if there are fewer contacts, or a misuse.
 */
dibs_code dibs_contacts_get(dibs_contacts *contacts, uint32_t number, dibs_contact *contact);

/**
 * Sets each contact's velocity to that of the surface at the contact.
 *
 * @param velocities  x, y and z (mm/s) of each vertex, in the tree's order of rows; only read during the call.
 * @param vertices    Their number.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_VERTEX_COUNT` if a contact's corner has no row, or a misuse.
 */
dibs_code dibs_contacts_set_velocities(dibs_contacts *contacts,
                                       const float *velocities,
                                       uint32_t vertices);

/**
 * The rows of all contacts in the list, deepest first.
 *
 * By its row, a contact's separation decreases towards `stand_off` no faster than exponentially, at a rate of `gain`;
 * below `stand_off` it must increase.
 *
 * @param contacts   The list.
 * @param origin     The tool's point (mm) that the rows' velocity refers to.
 * @param stand_off  In mm.
 * @param gain       In 1/s.
 * @param capacity   Number of rows that fit in `rows`.
 * @param rows       Receives them.
 * @param count      Receives their number.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_CAPACITY` if not all rows fit, or a misuse.
 */
dibs_code dibs_contacts_rows(dibs_contacts *contacts,
                             dibs_vec3 origin,
                             float stand_off,
                             float gain,
                             size_t capacity,
                             dibs_row *rows,
                             size_t *count);

/**
 * Makes a machine.
 *
 * @param storage   `DIBS_FAILSAFE_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
 * @param size      Bytes of the storage.
 * @param limits    Its limits.
 * @param failsafe  Receives the machine's address.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_LIMIT_ORDER` to `DIBS_CODE_LIMIT_RECOVERY`, `DIBS_CODE_LIMIT_UNTRIPPABLE`, or a
 *         misuse.
 */
dibs_code dibs_failsafe_init(void *storage,
                             size_t size,
                             const dibs_limits *limits,
                             dibs_failsafe **failsafe);

/**
 * One control tick of the machine.
 *
 * Cost: a comparison of two limits for each input.
 *
 * @return `DIBS_CODE_OK`, whatever the state; `DIBS_CODE_ARGUMENT` for an invalid code of the query; or a misuse.
 */
dibs_code dibs_failsafe_step(dibs_failsafe *failsafe,
                             const dibs_observation *seen,
                             dibs_verdict *verdict);

/**
 * An operator's acknowledgement: the next step leaves the safe state if its inputs are within their limits.
 *
 * @return `DIBS_CODE_OK`, `DIBS_CODE_ACKNOWLEDGE` unless the last step waited for it, or a misuse.
 */
dibs_code dibs_failsafe_acknowledge(dibs_failsafe *failsafe);

/**
 * Widens an answer by the verdict's margin, if it may be acted on.
 *
 * @param verdict    The verdict of this tick.
 * @param proximity  The answer of this tick, which is widened.
 * @return `DIBS_CODE_OK`; in the safe state the cause, to be passed on to a wall; `DIBS_CODE_ARGUMENT` for numbers
 *         that are not a state or a code; or a misuse.
 */
dibs_code dibs_verdict_admit(const dibs_verdict *verdict,
                             dibs_proximity *proximity);

/**
 * A filter with 200,000 instructions of a Cortex-M7 a tick.
 *
 * @param stand_off  Least separation (mm) from the tissue.
 * @param speed      Largest speed (mm/s) of the robot.
 */
dibs_filter dibs_filter_of(float stand_off, float speed);

/**
 * The motion closest to a commanded one that keeps every tool of a rigid chain out of the tissue at every instant of
 * the period. After an error nothing is admitted: the tool must rest.
 *
 * The promise is that of the core's module `filter`, provided that the robot executes the motion, the tissue is within
 * its uncertainty and no faster than stated, and the surface is within its stretch limit. If the budget ends a search,
 * its tracker continues in the next tick.
 *
 * Cost: at most the filter's instructions, by `cost`.
 *
 * @param filter       The filter.
 * @param trackers     Addresses of the trackers, one for each tool. No tracker may be listed twice.
 * @param frame        A reader's frame, used for all tools without copying it; null for the trackers' own surfaces.
 * @param tools        The tools as they are now, in the same order.
 * @param count        Number of tools: 1 to `DIBS_FILTER_TOOLS`.
 * @param command      The commanded motion.
 * @param period       The period, in s: above 0.
 * @param uncertainty  That of the tissue.
 * @param rows         The caller's rows; null for none.
 * @param row_count    Their number: at most `DIBS_FILTER_ROWS`.
 * @param admitted     Receives the motion to execute, and its reason; nothing is written after an error.
 * @return `DIBS_CODE_OK`, whatever the reason; `DIBS_CODE_FILTER` for a number out of its range;
 *         `DIBS_CODE_NOT_FINITE` for a command or a row that is not finite; `DIBS_CODE_ARGUMENT` for no tool or too
 *         many, too many rows or labels, a label's stand-off for a tree without labels, or a frame of the caller's
 *         vertices; the errors of `dibs_tracker_closest`; or a misuse.
 */
dibs_code dibs_filter_admit(const dibs_filter *filter,
                            dibs_tracker *const *trackers,
                            dibs_frame *frame,
                            const dibs_tool *tools,
                            uint32_t count,
                            const dibs_rigid_motion *command,
                            float period,
                            const dibs_uncertainty *uncertainty,
                            const dibs_motion_row *rows,
                            uint32_t row_count,
                            dibs_admitted_motion *admitted);

/**
 * A tool after a motion of up to half a radian: each point of the axis is rotated and displaced.
 *
 * @param motion  The motion.
 * @param tool    The tool before.
 * @param moved   Receives the tool after; may be the same.
 * @return `DIBS_CODE_OK`, or a misuse.
 */
dibs_code dibs_rigid_motion_apply(const dibs_rigid_motion *motion, const dibs_tool *tool, dibs_tool *moved);

/**
 * The distance (mm) between tool and searched surface at which a period can begin without a risk of contact: the
 * uncertainty at its end. A filter adds its stand-off to this.
 *
 * @param uncertainty  The uncertainty at the start.
 * @param period       The period, in s.
 * @param distance     Receives the distance.
 * @return `DIBS_CODE_OK`, or a misuse.
 */
dibs_code dibs_uncertainty_stand_off(const dibs_uncertainty *uncertainty,
                                     float period,
                                     float *distance);

/**
 * Makes an empty frame. If the storage has a frame that a reader holds, it is released first.
 *
 * @param storage  `DIBS_FRAME_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
 * @param size     Bytes of the storage.
 * @param frame    Receives the frame's address.
 */
dibs_code dibs_frame_init(void *storage, size_t size, dibs_frame **frame);

/**
 * Sets the frame to these vertices. Their stretch is not measured: queries assume the tree's limit.
 *
 * @param frame           The frame; if a reader holds it, it is released first.
 * @param positions       x, y and z (mm) of each vertex, in the tree's order of rows, not that of the mesh's file:
 *                        `dibs_tree_to_rows`. Not copied: they must not change until the frame is given other vertices
 *                        or released.
 * @param vertices        Their number.
 * @param position_error  Largest error (mm, at least 0) of a vertex position. Part of the accuracy of every answer.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_ARGUMENT` for an error that is negative or not finite, or a misuse.
 */
dibs_code dibs_frame_set_vertices(dibs_frame *frame,
                                  const float *positions,
                                  uint32_t vertices,
                                  float position_error);

/**
 * Sets the frame to the surface that these nodes move, for a tree that `dibs build --nodes` made. Vertices are
 * computed when a query reads them. The stretch is not measured: queries assume the tree's limit.
 *
 * @param frame           The frame; if a reader holds it, it is released first.
 * @param tree            The tree, which must exist as long as the frame has these nodes.
 * @param positions       x, y and z (mm) of each node, in the order of the volume's file. Not copied: they must not
 *                        change until the frame is given other positions or released.
 * @param nodes           Their number.
 * @param position_error  Largest error (mm, at least 0) of a node position.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_VERTEX_COUNT` for another number than the tree's `rows`, `DIBS_CODE_ARGUMENT` if
 *         the tree has no nodes, or for an error that is negative or not finite, or a misuse.
 */
dibs_code dibs_frame_set_nodes(dibs_frame *frame,
                               dibs_tree *tree,
                               const float *positions,
                               uint32_t nodes,
                               float position_error);

/**
 * Measures the stretch of the frame, which makes queries on it cheaper. A receiver's frames are already measured.
 *
 * Cost: linear in the triangles.
 *
 * @param stretch  Receives the largest stretch, 1 for none; or null.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_STRETCH_EXCEEDED` if distances on this frame could be wrong, as with vertices in
 *         the file's order, `DIBS_CODE_NO_SURFACE` for an empty frame, `DIBS_CODE_TREE_NO_METRIC`,
 *         `DIBS_CODE_VERTEX_COUNT`, or a misuse.
 */
dibs_code dibs_frame_measure(dibs_frame *frame,
                             dibs_tree *tree,
                             float *stretch);

/**
 * Reads the properties of a frame.
 *
 * @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` for an empty frame, or a misuse.
 */
dibs_code dibs_frame_get_facts(dibs_frame *frame, dibs_frame_facts *facts);

/**
 * Releases the vertices, or the frame that a reader holds: the next frame can then be published.
 */
dibs_code dibs_frame_release(dibs_frame *frame);

/**
 * Makes the control tick's end of a surface, once. `dibs_start` makes it together with all other objects.
 *
 * @param storage  `DIBS_GUARD_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
 * @param size     Bytes of the storage.
 * @param surface  The surface, in `DIBS_GUARDED_SIZE(vertices)` bytes.
 * @param tree     Its tree.
 * @param limits   The guard's limits: the same as for `dibs_bus_init`.
 * @param guard    Receives the guard's address.
 * @return `DIBS_CODE_OK`; `DIBS_CODE_OTHER_TREE` if the surface's number of rows is not the tree's;
 *         `DIBS_CODE_STORAGE_SIZE` also if the surface has only two buffers; `DIBS_CODE_TAKEN` if its end was taken;
 *         `DIBS_CODE_LIMIT_ORDER` to `DIBS_CODE_LIMIT_RECOVERY`; or a misuse.
 */
dibs_code dibs_guard_init(void *storage,
                          size_t size,
                          dibs_surface *surface,
                          dibs_tree *tree,
                          const dibs_guard_limits *limits,
                          dibs_guard **guard);

/**
 * The answer of this tick: the closest pair on the latest published surface, extrapolated to now, and whether to trust
 * it.
 *
 * Call it at every tick. An error of the query is reported in the answer, and leads to the safe state.
 *
 * Cost: at most the budget, and about a thousand instructions.
 *
 * @param guard   The guard.
 * @param tool    The tool; null if it has no pose: the answer is then the hold, and the velocity is measured anew.
 * @param now     The receiver's clock, in ms; wraps.
 * @param answer  Receives the answer.
 * @return `DIBS_CODE_OK`, whatever the state; `DIBS_CODE_TOOL_COORDINATE` or `DIBS_CODE_TOOL_RADIUS`, with the same
 *         answer as without a pose; or a misuse.
 */
dibs_code dibs_guard_closest(dibs_guard *guard,
                             const dibs_tool *tool,
                             uint32_t now,
                             dibs_answer *answer);

/**
 * The answer of this tick, and all locally closest pairs with a separation of at most `margin`, deepest first, within
 * the same budget. Each has the velocity of the surface there, so `dibs_contacts_set_velocities` is not needed.
 *
 * Call it instead of `dibs_guard_closest`. Act on the list only if the answer's outcome is `DIBS_CODE_OK`. Unless the
 * side is undefined, its first contact counts: nothing is deeper; beyond the list's bound others may be missing. The
 * list's accuracy includes the surface's error and age.
 *
 * Cost: that of `dibs_guard_closest`, and some hundred instructions a contact.
 *
 * @param guard     The guard.
 * @param tool      The tool; null if it has no pose: the list is then empty.
 * @param margin    In mm, at least 0.
 * @param now       The receiver's clock, in ms; wraps.
 * @param contacts  The list; empty if there is no surface, or the query failed.
 * @param answer    Receives the answer.
 * @return As `dibs_guard_closest`.
 */
dibs_code dibs_guard_contacts(dibs_guard *guard,
                              const dibs_tool *tool,
                              float margin,
                              uint32_t now,
                              dibs_contacts *contacts,
                              dibs_answer *answer);

/**
 * The answer of this tick, and the motion closest to a commanded one that keeps the tool out of the tissue until the
 * next tick. The period, the tissue's speed, lag and transit time are the guard's. The surface is extrapolated, and
 * its residual is an estimate.
 *
 * Call it instead of `dibs_guard_closest`. After an error nothing is admitted: the tool must rest.
 *
 * Cost: that of `dibs_guard_closest` and of `dibs_filter_admit`.
 *
 * @param guard     The guard.
 * @param filter    The filter.
 * @param tool      The tool as it is now.
 * @param command   The commanded motion.
 * @param now       The receiver's clock, in ms; wraps.
 * @param answer    Receives the answer, even if nothing is admitted; or null.
 * @param admitted  Receives the motion to execute.
 * @return As `dibs_filter_admit`; in the safe state its cause.
 */
dibs_code dibs_guard_admit(dibs_guard *guard,
                           const dibs_filter *filter,
                           const dibs_tool *tool,
                           const dibs_rigid_motion *command,
                           uint32_t now,
                           dibs_answer *answer,
                           dibs_admitted_motion *admitted);

/**
 * An operator's acknowledgement, which ends the safe state once every input is good again.
 *
 * @return `DIBS_CODE_OK`, `DIBS_CODE_ACKNOWLEDGE` unless the last tick waited for it, or a misuse.
 */
dibs_code dibs_guard_acknowledge(dibs_guard *guard);

/**
 * The force of a wall on the tool, from a tick's answer.
 *
 * @param answer  The answer of this tick.
 * @param wall    The wall.
 * @param force   Receives the force.
 * @return As `dibs_wall_force`.
 */
dibs_code dibs_answer_force(const dibs_answer *answer, const dibs_wall *wall, dibs_force *force);

/**
 * The limits that follow from two numbers: 1,000 ticks a second, no budget, and an operator who acknowledges.
 *
 * @param speed  Largest speed (mm/s) of any point of the tissue.
 * @param age    Largest age (ms) of a surface.
 */
dibs_guard_limits dibs_guard_limits_of(float speed, uint32_t age);

/**
 * Receives a whole frame from this process, for example from a solver's own thread. `dibs_bus_work` then checks and
 * publishes it like a frame of packets.
 *
 * The call counts as a good packet, and the frame's transit time is 0. Use one source at a time: an unfinished frame
 * of packets is abandoned. There is no lock: the control tick reads the last surface meanwhile.
 *
 * Cost: linear in the vertices, each of which is read several times.
 *
 * @param bus        The bus.
 * @param positions  x, y and z (mm, less the tree's origin) of each vertex of the mesh's file, in that file's order.
 *                   Read during the call.
 * @param count      Their number: the vertices of the mesh's file.
 * @param captured   Time of capture on the receiver's clock, in ms: at most 65,534 before `now`.
 * @param now        The receiver's clock, in ms; wraps.
 * @return `DIBS_CODE_OK`, a cause of refusal as from `dibs_receiver_accept` (the last good surface stays), or a
 *         misuse.
 */
dibs_code dibs_bus_frame(dibs_bus *bus,
                         const float *positions,
                         uint32_t count,
                         uint32_t captured,
                         uint32_t now);

/**
 * The same as `dibs_bus_frame`, with a rigid pose of the whole mesh, for example from a tracker of the patient: tools,
 * answers and commands are then in world coordinates. Without a pose the mesh is where its file has it.
 *
 * The limits on speed and recovery apply to positions and pose together; the reach applies to the positions alone. If
 * a step rotates by more than half a radian, the surface is held at the last frame, not extrapolated.
 *
 * @param bus        The bus.
 * @param positions  As for `dibs_bus_frame`.
 * @param count      Their number.
 * @param pose       The pose, read during the call.
 * @param captured   Time of capture of positions and pose.
 * @param now        The receiver's clock, in ms; wraps.
 * @return As `dibs_bus_frame`; `DIBS_CODE_PACKET_NOT_FINITE`, `DIBS_CODE_PACKET_TOO_FAR` or `DIBS_CODE_PACKET_FORM`
 *         for an invalid pose.
 */
dibs_code dibs_bus_frame_at(dibs_bus *bus,
                            const float *positions,
                            uint32_t count,
                            const dibs_pose *pose,
                            uint32_t captured,
                            uint32_t now);

/**
 * The same as `dibs_bus_frame`, by the weights of the tree's displacement modes (`dibs build --motion --modes`), with
 * or without a pose. All vertices are computed, and the modes' own error is part of each answer's accuracy.
 *
 * Cost: linear in vertices times modes, several times.
 *
 * @param bus       The bus.
 * @param tree      Its tree.
 * @param weights   The weight of each mode, read during the call.
 * @param count     Their number.
 * @param pose      The pose of the whole mesh, as for `dibs_bus_frame_at`, or null.
 * @param captured  As for `dibs_bus_frame`.
 * @param now       The receiver's clock, in ms; wraps.
 * @return As `dibs_bus_frame_at`; `DIBS_CODE_TREE_NO_MODES`; `DIBS_CODE_PACKET_ROWS` for another number of weights than
 *         modes; `DIBS_CODE_PACKET_NOT_FINITE`; `DIBS_CODE_PACKET_TOO_FAR` for a weight out of its range;
 *         `DIBS_CODE_PACKET_MESH` for another tree than the bus's.
 */
dibs_code dibs_bus_weights(dibs_bus *bus,
                           dibs_tree *tree,
                           const float *weights,
                           uint32_t count,
                           const dibs_pose *pose,
                           uint32_t captured,
                           uint32_t now);

/**
 * The certified interval of a separation: both bounds include the accuracy, rounded outwards. Act on the lower one.
 *
 * Without a side the tool may be inside to any depth: the lower bound is negative infinity. With `DIBS_SIDE_NOT_ASKED`
 * and `DIBS_SIDE_NO_ADJACENCY` it is that of a tool outside.
 *
 * @return `DIBS_CODE_OK`, `DIBS_CODE_ARGUMENT` for an invalid side or coverage, or a misuse.
 */
dibs_code dibs_proximity_interval(const dibs_proximity *proximity,
                                  dibs_interval *interval);

/**
 * Makes a query on a tree.
 *
 * @param storage  `DIBS_QUERY_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
 * @param size     Bytes of the storage.
 * @param tree     The tree.
 * @param query    Receives the query's address.
 */
dibs_code dibs_query_init(void *storage, size_t size, dibs_tree *tree, dibs_query **query);

/**
 * The closest pair of the tool and the surface in the frame.
 *
 * Exact within `accuracy`, as long as the surface is within its stretch limit. A budget that runs out is not an error:
 * the interval is then wider.
 *
 * Cost: at most the budget.
 *
 * @param query      The query.
 * @param frame      The surface.
 * @param tool       The tool.
 * @param options    Options, or null.
 * @param proximity  Receives the answer; nothing is written unless the code is `DIBS_CODE_OK`.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` for an empty frame, `DIBS_CODE_TOOL_COORDINATE` to
 *         `DIBS_CODE_QUERY_FAILED`, `DIBS_CODE_TREE_CORRUPT`, or a misuse.
 */
dibs_code dibs_query_closest(dibs_query *query,
                             dibs_frame *frame,
                             const dibs_tool *tool,
                             const dibs_options *options,
                             dibs_proximity *proximity);

/**
 * The budget of a query or tick that must end within this number of instructions, by a fitted model with a margin.
 *
 * @param cost  A `dibs_cost`.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_ARGUMENT` for a number that is not a `dibs_cost`, or a misuse.
 */
dibs_code dibs_budget_for_instructions(uint32_t instructions,
                                       uint32_t cost,
                                       uint32_t *budget);

/**
 * Makes the reader of a surface, once.
 *
 * @param storage  `DIBS_READER_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
 * @param size     Bytes of the storage.
 * @param surface  The surface.
 * @param reader   Receives the reader's address.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_TAKEN` if the surface has a reader already, or a misuse.
 */
dibs_code dibs_reader_init(void *storage, size_t size, dibs_surface *surface, dibs_reader **reader);

/**
 * Holds the latest published frame, if it is not too old. Until it is released no frame is published, so release it
 * after the tick's queries.
 *
 * @param reader  The reader.
 * @param now     The receiver's clock, in ms; wraps.
 * @param limit   Largest age, in ms; UINT32_MAX leaves the age to the fail-safe machine.
 * @param frame   Holds the frame; a frame that it held before is released.
 * @param age     Receives its age, even if it is too old; or null.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE`, `DIBS_CODE_STALE`, `DIBS_CODE_HELD` if another frame holds one of
 *         this surface, or a misuse. After an error the frame is empty.
 */
dibs_code dibs_reader_latest(dibs_reader *reader,
                             uint32_t now,
                             uint32_t limit,
                             dibs_frame *frame,
                             dibs_age *age);

/**
 * The health of the bus at `now`, on the receiver's clock in ms.
 */
dibs_code dibs_reader_link(dibs_reader *reader, uint32_t now, dibs_link *link);

/**
 * Makes the receiver of a surface, once.
 *
 * @param storage   `DIBS_RECEIVER_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
 * @param size      Bytes of the storage.
 * @param surface   The surface.
 * @param tree      Its tree.
 * @param limits    Limits of every frame.
 * @param receiver  Receives the receiver's address.
 * @return `DIBS_CODE_OK`; `DIBS_CODE_OTHER_TREE` if the surface's number of vertices is not the tree's;
 *         `DIBS_CODE_TAKEN` if the surface has a receiver already; `DIBS_CODE_TREE_NO_METRIC`; or a misuse.
 */
dibs_code dibs_receiver_init(void *storage,
                             size_t size,
                             dibs_surface *surface,
                             dibs_tree *tree,
                             const dibs_surface_limits *limits,
                             dibs_receiver **receiver);

/**
 * The same, for a sender with a key: a packet without a genuine tag is refused and counted.
 *
 * @param storage   As for `dibs_receiver_init`.
 * @param size      Bytes of the storage.
 * @param surface   The surface.
 * @param tree      Its tree.
 * @param limits    Limits of every frame.
 * @param tags      The tags.
 * @param receiver  Receives the receiver's address.
 * @return As `dibs_receiver_init`.
 */
dibs_code dibs_receiver_init_with_tags(void *storage,
                                       size_t size,
                                       dibs_surface *surface,
                                       dibs_tree *tree,
                                       const dibs_surface_limits *limits,
                                       dibs_tags *tags,
                                       dibs_receiver **receiver);

/**
 * Registers the surface again: the next whole frame is not compared with an earlier one. For an operator who knows
 * that the tissue was moved farther than `dibs_surface_limits.recovery`; until then no frame that far away is
 * published.
 *
 * @return `DIBS_CODE_OK`, or a misuse.
 */
dibs_code dibs_receiver_register(dibs_receiver *receiver);

/**
 * Receives one whole packet: a datagram, or the data of a CAN-FD message.
 *
 * Cost: linear in the bytes.
 *
 * @param receiver  The receiver.
 * @param packet    The packet, read during the call.
 * @param length    Its bytes.
 * @param now       The receiver's clock, in ms; wraps.
 * @param progress  Receives its outcome, or null.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_PACKET_DAMAGED` to `DIBS_CODE_PACKET_REFUSED` if the packet was refused (and
 *         counted), or a misuse.
 */
dibs_code dibs_receiver_accept(dibs_receiver *receiver,
                               const uint8_t *packet,
                               size_t length,
                               uint32_t now,
                               dibs_progress *progress);

/**
 * Receives one byte of a stream of COBS frames, each ended by a zero, such as a serial line.
 *
 * @param receiver  The receiver.
 * @param byte      The byte.
 * @param now       The receiver's clock, in ms; wraps.
 * @param progress  Receives the outcome of the packet that the byte completes, or `DIBS_PROGRESS_NONE`; or null.
 * @return As `dibs_receiver_accept`; `DIBS_CODE_FRAMING` if the bytes between two zeros are not a packet.
 */
dibs_code dibs_receiver_byte(dibs_receiver *receiver,
                             uint8_t byte,
                             uint32_t now,
                             dibs_progress *progress);

/**
 * Does some of the pending work: checks rows and triangles, and publishes a frame that is within its limits.
 *
 * Call it after each packet, and from time to time when the bus is quiet. Cost: linear in `work`.
 *
 * @param receiver  The receiver.
 * @param work      Most rows and triangles that are checked or copied.
 * @param advance   Receives the outcome, or null.
 * @return `DIBS_CODE_OK`; `DIBS_CODE_STRETCH_EXCEEDED`, `DIBS_CODE_SHRUNK` or `DIBS_CODE_TOO_FAST` if the frame is
 *         refused (and counted); or a misuse.
 */
dibs_code dibs_receiver_advance(dibs_receiver *receiver,
                                uint32_t work,
                                dibs_advance *advance);

/**
 * Writes the receiver's status for the sender: every 100 ms or so, and as soon as a hello asks for it.
 *
 * @param receiver  The receiver.
 * @param now       The receiver's clock, in ms.
 * @param safety    0 not reported, 1 nominal, 2 degraded, 3 safe.
 * @param framed    0 for a packet; otherwise a COBS frame with the zero that ends it, for a stream.
 * @param out       Receives the status.
 * @param capacity  Size of `out` in bytes: `DIBS_STATUS` is enough.
 * @param length    Receives the status's length.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_CAPACITY`, or a misuse.
 */
dibs_code dibs_receiver_status(dibs_receiver *receiver,
                               uint32_t now,
                               uint8_t safety,
                               uint32_t framed,
                               uint8_t *out,
                               size_t capacity,
                               size_t *length);

/**
 * Number of the latest published frame; wraps.
 *
 * @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` before the first frame, or a misuse.
 */
dibs_code dibs_receiver_epoch(dibs_receiver *receiver, uint32_t *epoch);

/**
 * Position (mm) of a vertex in the latest published frame, for a checksum of the published rows, or a log.
 *
 * @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` before the first frame, `DIBS_CODE_ARGUMENT` outside the table, or a
 *         misuse.
 */
dibs_code dibs_receiver_position(dibs_receiver *receiver,
                                 uint32_t row,
                                 dibs_vec3 *position);

/**
 * Name of an event, in English: published, abandoned, duplicate, heartbeat, then rejections by their cause.
 *
 * @param event  Its index among the counters.
 * @return A static text; never null, even for a number that is not an event.
 */
const char *dibs_event_name(uint32_t event);

/**
 * The count of each event since the start, in the order of `dibs_event_name`.
 *
 * @param receiver  The receiver.
 * @param counters  Room for `DIBS_EVENTS` numbers.
 */
dibs_code dibs_receiver_counters(dibs_receiver *receiver, uint32_t *counters);

/**
 * The closest pair of a chain of tools and the surfaces of a scene.
 *
 * Exact within its accuracy, as `dibs_query_closest`. Tools whose axes do not touch each other must be queried one by
 * one: otherwise one deep inside a surface may be missed.
 *
 * Cost: at most the budget, for all pairs together, and a node test a pair.
 *
 * @param scene    The scene.
 * @param options  Options, or null.
 * @param closest  Receives the answer; nothing is written unless the code is `DIBS_CODE_OK`.
 * @return As `dibs_query_closest`, for any surface; `DIBS_CODE_ARGUMENT` for no surface, no tool, or too many.
 */
dibs_code dibs_scene_closest(const dibs_scene *scene,
                             const dibs_options *options,
                             dibs_closest *closest);

/**
 * Fills the list with the contacts of all pairs of a tool and a surface, deepest first, and finds the closest pair:
 * `surface` and `tool` of a `dibs_contact` tell the pairs apart.
 *
 * Cost: that of `dibs_scene_closest`, and for each pair within the margin that of `dibs_query_contacts`.
 *
 * @param scene     The scene.
 * @param margin    In mm, at least 0.
 * @param options   Options, or null. A budget that runs out lowers the list's bound, which holds for all pairs.
 * @param contacts  The list; empty after an error.
 * @param closest   Receives the closest pair, or null.
 * @return As `dibs_scene_closest`, `DIBS_CODE_MARGIN`, or `DIBS_CODE_TREE_NO_ADJACENCY`.
 */
dibs_code dibs_scene_contacts(const dibs_scene *scene,
                              float margin,
                              const dibs_options *options,
                              dibs_contacts *contacts,
                              dibs_closest *closest);

/**
 * Connects to a controller, and makes the sender of a surface.
 *
 * @param storage   `DIBS_SENDER_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
 * @param size      Bytes of the storage.
 * @param tree      The surface's tree: the controller's, or one built from the same mesh in the same way. Not used
 *                  after the call.
 * @param target    `udp:HOST:PORT`, `tcp:HOST:PORT`, `serial:PORT@BAUD` or `unix:PATH`, ended by a zero.
 * @param settings  How to send; or null for `dibs_sender_settings_of`.
 * @param sender    Receives the sender's address.
 * @return `DIBS_CODE_OK`; `DIBS_CODE_SENDER_TARGET` for a target that is invalid or cannot be opened; or a misuse.
 */
dibs_code dibs_sender_init(void *storage,
                           size_t size,
                           dibs_tree *tree,
                           const char *target,
                           const dibs_sender_settings *settings,
                           dibs_sender **sender);

/**
 * The same, for a receiver that demands tags. `dibs_sender_poll` asks it for its challenge; until the answer arrives, no
 * frame can be sent.
 *
 * @param storage   As for `dibs_sender_init`.
 * @param size      Bytes of the storage.
 * @param tree      The surface's tree.
 * @param target    As for `dibs_sender_init`.
 * @param settings  How to send; or null.
 * @param key       `DIBS_KEY` bytes that the receiver has, too. Not used after the call.
 * @param receiver  The receiver's number, as in its `dibs_tags_init`.
 * @param sender    Receives the sender's address.
 * @return As `dibs_sender_init`.
 */
dibs_code dibs_sender_init_with_key(void *storage,
                                    size_t size,
                                    dibs_tree *tree,
                                    const char *target,
                                    const dibs_sender_settings *settings,
                                    const uint8_t *key,
                                    uint32_t receiver,
                                    dibs_sender **sender);

/**
 * Sets the challenge that the receiver gave to its `dibs_tags_init`, for a line without a way back: over any other line the
 * receiver reports it.
 *
 * @return `DIBS_CODE_OK`; `DIBS_CODE_ARGUMENT` if the sender has no key; or a misuse.
 */
dibs_code dibs_sender_challenge(dibs_sender *sender,
                                uint64_t challenge);

/**
 * Sends a frame, with heartbeats between its packets when due. From the third whole frame on over UDP, this thread
 * allocates nothing.
 *
 * @param sender     The sender.
 * @param positions  x, y and z (mm, less the tree's origin) of each vertex of the mesh's file, in that file's order;
 *                   or of each node that carries the surface.
 * @param count      Their number.
 * @param age        Time (ms) since the surface was captured; or `DIBS_AGE_UNKNOWN`.
 * @param sent       Receives the frame's number and size; or null.
 * @return `DIBS_CODE_OK`; `DIBS_CODE_SENDER_FRAME` for positions that are not a frame of the surface: nothing was
 *         sent; `DIBS_CODE_SENDER_LINE` if the connection broke: close the sender, and make another;
 *         `DIBS_CODE_SENDER_NO_CHALLENGE` with a key, before `dibs_sender_poll` has met the receiver's challenge;
 *         `DIBS_CODE_SENDER_SUPERSEDED`; `DIBS_CODE_SENDER_OTHER_SURFACE`; or a misuse. `dibs_sender_error` has the
 *         full text.
 */
dibs_code dibs_sender_send(dibs_sender *sender,
                           const float *positions,
                           uint32_t count,
                           uint32_t age,
                           dibs_sent_frame *sent);

/**
 * The same as `dibs_sender_send`, for a mesh at a rigid pose. For a `dibs_bus`; a `dibs_receiver` refuses such frames.
 *
 * @param sender     The sender.
 * @param positions  As for `dibs_sender_send`: those of the mesh's own frame.
 * @param count      Their number.
 * @param pose       The pose, read during the call.
 * @param age        Time (ms) since the older of positions and pose was measured. It must be stated, since the same
 *                   positions at a new pose may be a rigid mesh, or a source that has stopped.
 * @param sent       Receives the frame's number and size; or null.
 * @return As `dibs_sender_send`; `DIBS_CODE_SENDER_FRAME` also for numbers that are no pose, and `DIBS_CODE_ARGUMENT`
 *         for `DIBS_AGE_UNKNOWN`.
 */
dibs_code dibs_sender_send_at(dibs_sender *sender,
                              const float *positions,
                              uint32_t count,
                              const dibs_pose *pose,
                              uint32_t age,
                              dibs_sent_frame *sent);

/**
 * Sends a heartbeat if one is due, and receives the statuses that have arrived. Does not wait. Call it a few times
 * between two heartbeats: otherwise the controller considers the link lost, and no transit time is measured.
 *
 * @return As `dibs_sender_send`.
 */
dibs_code dibs_sender_poll(dibs_sender *sender);

/**
 * The text of a sender's last error.
 *
 * @param sender    The sender.
 * @param text      Receives the zero-terminated text; empty before the first error.
 * @param capacity  Size of `text` in bytes.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_CAPACITY`, or a misuse.
 */
dibs_code dibs_sender_error(dibs_sender *sender, uint8_t *text, size_t capacity);

/**
 * Reads the state of a sender.
 *
 * @param sender    The sender.
 * @param facts     Receives the state.
 * @param counters  Room for `DIBS_EVENTS` numbers: the receiver's count of each event, in the order of
 *                  `dibs_event_name`, as its statuses report it; or null.
 */
dibs_code dibs_sender_get_facts(dibs_sender *sender, dibs_sender_facts *facts, uint32_t *counters);

/**
 * Ends the connection. The storage then holds no sender.
 *
 * @return `DIBS_CODE_OK`, or a misuse.
 */
dibs_code dibs_sender_close(dibs_sender *sender);

/**
 * The default settings: 6 bytes a vertex, whole frames, a heartbeat every 100 ms.
 */
dibs_sender_settings dibs_sender_settings_of(void);

/**
 * Makes all objects of a control loop in one piece of memory: validates the tree, and makes the surface and its two
 * ends. To make each object in memory of its own, use `dibs_tree_init`, `dibs_surface_init`, `dibs_bus_init` and
 * `dibs_guard_init`.
 *
 * Cost: linear in the bytes; once, at start-up.
 *
 * @param memory  `DIBS_START_SIZE(rows)` bytes, with the rows of the tree's facts (vertices, or nodes that move them),
 *                aligned to `DIBS_ALIGNMENT`, for as long as an end is used. Needs no initial value.
 * @param size    Bytes of the memory.
 * @param bytes   The tree, in flash or in memory. Not copied: as for `dibs_tree_init`.
 * @param length  Bytes of the tree.
 * @param limits  The guard's limits.
 * @param bus     Receives the bus's address.
 * @param guard   Receives the guard's address.
 * @return As the four functions; `DIBS_CODE_STORAGE_SIZE` if the tree has more rows than fit.
 */
dibs_code dibs_start(void *memory,
                     size_t size,
                     const uint8_t *bytes,
                     size_t length,
                     const dibs_guard_limits *limits,
                     dibs_bus **bus,
                     dibs_guard **guard);

/**
 * The same, for a sender with a key: a packet without a genuine tag is refused and counted.
 *
 * @param memory  As for `dibs_start`.
 * @param size    Bytes of the memory.
 * @param bytes   The tree.
 * @param length  Bytes of the tree.
 * @param limits  The guard's limits.
 * @param tags    The tags.
 * @param bus     Receives the bus's address.
 * @param guard   Receives the guard's address.
 * @return As `dibs_start`.
 */
dibs_code dibs_start_with_tags(void *memory,
                               size_t size,
                               const uint8_t *bytes,
                               size_t length,
                               const dibs_guard_limits *limits,
                               dibs_tags *tags,
                               dibs_bus **bus,
                               dibs_guard **guard);

/**
 * Makes a surface without a frame.
 *
 * @param storage   `DIBS_SURFACE_SIZE(vertices)` bytes, or `DIBS_GUARDED_SIZE(vertices)` for a guard, aligned to
 *                  `DIBS_ALIGNMENT`. Needs no initial value. Must exist for as long as its two ends and their frames
 *                  are used.
 * @param size      Bytes of the storage.
 * @param vertices  Rows of the surface: `rows` of the tree's facts.
 * @param surface   Receives the surface's address.
 */
dibs_code dibs_surface_init(void *storage,
                            size_t size,
                            uint32_t vertices,
                            dibs_surface **surface);

/**
 * Whether tool and surface come closer than a margin between two ticks, and when first, by conservative advancement:
 * no time is skipped at any speed. The distance is that to the surface itself, from either side.
 *
 * Cost: that of `dibs_tracker_closest` for each sample; the budget is for each.
 *
 * @param tracker  The tracker, which has a surface.
 * @param sweep    The motion.
 * @param options  Options, or null.
 * @param swept    Receives the result.
 * @return As `dibs_tracker_closest`; `DIBS_CODE_MARGIN` and `DIBS_CODE_ARGUMENT` for a margin and a `t` out of
 *         range.
 */
dibs_code dibs_tracker_sweep(dibs_tracker *tracker,
                             const dibs_sweep *sweep,
                             const dibs_options *options,
                             dibs_swept *swept);

/**
 * Makes the tags of one receiver, for `dibs_start_with_tags`, `dibs_bus_init_with_tags` or
 * `dibs_receiver_init_with_tags`.
 *
 * @param storage    `DIBS_TAGS_SIZE` bytes, aligned to `DIBS_ALIGNMENT`, for as long as the receiver is used. They hold
 *                   the key in another form.
 * @param size       Bytes of the storage.
 * @param key        `DIBS_KEY` bytes that the sender has, too. Not used after the call.
 * @param receiver   The receiver's number: no two receivers under one key may have the same.
 * @param challenge  Drawn anew at each start: a random number, or a counter that survives a restart. The sender reads it
 *                   from the answer to its hello. With 0, recordings of an earlier run are accepted until a later session
 *                   has published.
 * @param tags       Receives the tags' address.
 * @return `DIBS_CODE_OK`, or a misuse.
 */
dibs_code dibs_tags_init(void *storage,
                         size_t size,
                         const uint8_t *key,
                         uint32_t receiver,
                         uint64_t challenge,
                         dibs_tags **tags);

/**
 * Makes a tracker on a tree, without a surface.
 *
 * @param storage  `DIBS_TRACKER_SIZE(vertices)` bytes, aligned to `DIBS_ALIGNMENT`; `DIBS_TRACKER_SIZE(0)` is enough
 *                 for `dibs_tracker_closest_on` alone. Needs no initial value.
 * @param size     Bytes of the storage.
 * @param tree     The tree.
 * @param tracker  Receives the tracker's address.
 */
dibs_code dibs_tracker_init(void *storage,
                            size_t size,
                            dibs_tree *tree,
                            dibs_tracker **tracker);

/**
 * Sets a new surface: copies it, and measures how far it moved. Call it for each new frame, then release the frame; it
 * is not needed at ticks without a new frame.
 *
 * Cost: linear in the vertices.
 *
 * @param tracker  The tracker.
 * @param frame    The surface.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` for an empty frame, `DIBS_CODE_VERTEX_COUNT` (also if the storage has
 *         no room for copies), or a misuse. After an error the surface is the previous one.
 */
dibs_code dibs_tracker_set_frame(dibs_tracker *tracker,
                                 dibs_frame *frame);

/**
 * The closest pair of the tool and the tracker's surface: the answer of `dibs_query_closest`, within its accuracy.
 *
 * Cost: at most the budget, and one comparison for each opened node.
 *
 * @param tracker   The tracker.
 * @param tool      The tool.
 * @param options   Options, or null.
 * @param tracked   Receives the answer; nothing is written unless the code is `DIBS_CODE_OK`.
 * @return As `dibs_query_closest`.
 */
dibs_code dibs_tracker_closest(dibs_tracker *tracker,
                               const dibs_tool *tool,
                               const dibs_options *options,
                               dibs_tracked *tracked);

/**
 * The closest pair of the tool and the frame that a reader holds: the answer of `dibs_tracker_closest`, without
 * copying the surface, because the receiver has measured the frame's motion. The frame is held during the whole call;
 * release it afterwards. For a control tick that has no time for `dibs_tracker_set_frame`.
 *
 * Cost: at most the budget, and one comparison for each opened node.
 *
 * @param tracker   The tracker.
 * @param frame     A reader's frame.
 * @param tool      The tool.
 * @param options   Options, or null.
 * @param tracked   Receives the answer; nothing is written unless the code is `DIBS_CODE_OK`.
 * @return As `dibs_query_closest`; `DIBS_CODE_ARGUMENT` for a frame of the caller's vertices.
 */
dibs_code dibs_tracker_closest_on(dibs_tracker *tracker,
                                  dibs_frame *frame,
                                  const dibs_tool *tool,
                                  const dibs_options *options,
                                  dibs_tracked *tracked);

/**
 * Fills the list with all locally closest pairs with a separation of at most `margin`, deepest first: the list of
 * `dibs_query_contacts`.
 *
 * Cost: that of `dibs_tracker_closest`, and, if the surface is within the margin, of a range search
 * without memory of the last tick.
 *
 * @param tracker   The tracker.
 * @param tool      The tool.
 * @param margin    In mm, at least 0.
 * @param options   Options, or null. A budget that runs out lowers the list's bound.
 * @param contacts  The list; empty after an error.
 * @param tracked   Receives the closest pair, or null.
 * @return As `dibs_query_contacts`.
 */
dibs_code dibs_tracker_contacts(dibs_tracker *tracker,
                                const dibs_tool *tool,
                                float margin,
                                const dibs_options *options,
                                dibs_contacts *contacts,
                                dibs_tracked *tracked);

/**
 * The closest of several pairs, each a tracker with its surface and a tool: for a chain of tools, several surfaces, or
 * both. A pair that is certain to be farther than the closest is not searched.
 *
 * Cost: at most the budget, for all pairs together.
 *
 * @param trackers  Addresses of the trackers, one for each pair. No tracker may be listed twice.
 * @param tools     The tool of each pair, in the same order.
 * @param count     Number of pairs: 1 to `DIBS_TOOLS`.
 * @param options   Options, or null.
 * @param tracked   Receives the answer; nothing is written unless the code is `DIBS_CODE_OK`.
 * @return As `dibs_tracker_closest`, for any pair; `DIBS_CODE_ARGUMENT` for no pair or too many.
 */
dibs_code dibs_tracker_closest_of(dibs_tracker *const *trackers,
                                  const dibs_tool *tools,
                                  uint32_t count,
                                  const dibs_options *options,
                                  dibs_tracked *tracked);

/**
 * Validates the bytes of a tree, and makes the tree that all other objects need.
 *
 * Cost: linear in the bytes; once, at start-up.
 *
 * @param storage  `DIBS_TREE_SIZE` bytes, aligned to `DIBS_ALIGNMENT`, for as long as the tree is used.
 * @param size     Bytes of the storage.
 * @param bytes    The tree, in flash or in memory. Not copied: it must not change for as long as the tree, or any
 *                 object made with it, is used. It is read faster if aligned to 4.
 * @param length   Bytes of the tree.
 * @param tree     Receives the tree's address.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_TREE_LENGTH` to `DIBS_CODE_TREE_FORM`, or a misuse.
 */
dibs_code dibs_tree_init(void *storage,
                         size_t size,
                         const uint8_t *bytes,
                         size_t length,
                         dibs_tree **tree);

/**
 * Reads the properties of the tree.
 */
dibs_code dibs_tree_get_facts(dibs_tree *tree, dibs_tree_facts *facts);

/**
 * Rest position (mm) of the vertex in a row.
 *
 * @return `DIBS_CODE_OK`, or `DIBS_CODE_TREE_NO_REST_SHAPE` outside the table or if the tree was built without it.
 */
dibs_code dibs_tree_rest_position(dibs_tree *tree,
                                  uint32_t row,
                                  dibs_vec3 *position);

/**
 * The number, from 0, that the vertex in a row has in the mesh's file. An answer's `corners` are rows.
 *
 * @return `DIBS_CODE_OK`, or `DIBS_CODE_ARGUMENT` outside the table or if the tree was built without its vertex order.
 */
dibs_code dibs_tree_vertex_number(dibs_tree *tree,
                                  uint32_t row,
                                  uint32_t *number);

/**
 * Copies positions, or velocities, of the mesh file's vertices from that file's order into the tree's order of rows,
 * as a frame needs them. A frame in the file's order gives wrong distances without an error, unless it is measured.
 * Only the order changes. Positions are in mm, less the tree's origin, which is not zero for a mesh far from the origin
 * of its file; velocities are in mm/s.
 *
 * Cost: linear in the vertices.
 *
 * @param tree    The tree.
 * @param values  x, y and z of each vertex of the mesh's file, in that file's order.
 * @param count   Their number: `file_vertices` of the tree's facts.
 * @param rows    Receives x, y and z of each row. Must not overlap `values`.
 * @param room    The number of rows that fit there: at least `vertices` of the tree's facts.
 * @return `DIBS_CODE_OK`; `DIBS_CODE_VERTEX_COUNT` for another number than the file's; `DIBS_CODE_CAPACITY` for too
 *         little room; `DIBS_CODE_ARGUMENT` if the tree was built without its vertex order, or if nodes move the
 *         surface (their order is the volume's); or a misuse.
 */
dibs_code dibs_tree_to_rows(dibs_tree *tree,
                            const float *values,
                            uint32_t count,
                            float *rows,
                            uint32_t room);

/**
 * Label of the triangle in a row, for example of its tissue.
 *
 * @return `DIBS_CODE_OK`, or `DIBS_CODE_ARGUMENT` outside the table or if the tree was built without labels.
 */
dibs_code dibs_tree_label(dibs_tree *tree, uint32_t triangle, uint8_t *label);

/**
 * Compares the tree's header and section offsets, which are copied to memory, with its bytes. A scrub does not check
 * that copy: call this once a tick.
 *
 * Cost: some hundred instructions.
 *
 * @return `DIBS_CODE_OK`; `DIBS_CODE_TREE_CORRUPT` if the two differ: make the output safe; or a misuse.
 */
dibs_code dibs_tree_check(dibs_tree *tree);

/**
 * Makes a check of the tree's bytes.
 */
dibs_code dibs_scrub_init(void *storage, size_t size, dibs_tree *tree, dibs_scrub **scrub);

/**
 * Checks the next `most` bytes, and at the end of a round compares the checksum.
 *
 * @return `DIBS_CODE_OK`, or `DIBS_CODE_TREE_CORRUPT` at the end of a round in which the bytes did not match: make the
 *         output safe.
 */
dibs_code dibs_scrub_step(dibs_scrub *scrub,
                          size_t most);

/**
 * The point of the mesh's file that all coordinates of the tree are relative to: those of vertices, tools and answers.
 * Zero unless the file's coordinates are so far from their own origin that single precision would lose them; then
 * subtract it, in double precision, from each point in the file's coordinates.
 */
dibs_code dibs_tree_origin(dibs_tree *tree,
                           dibs_point *origin);

/**
 * Checks that a program was compiled with this library's header, because sizes of objects may differ between versions.
 * A program that is linked with a shared library calls this before it makes an object.
 *
 * @param version  `DIBS_VERSION`.
 * @return `DIBS_CODE_OK`, or `DIBS_CODE_VERSION`.
 */
dibs_code dibs_check_version(uint32_t version);

/**
 * Makes the writer of a surface, once.
 *
 * @param storage  `DIBS_WRITER_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
 * @param size     Bytes of the storage.
 * @param surface  The surface.
 * @param writer   Receives the writer's address.
 * @return `DIBS_CODE_OK`, `DIBS_CODE_TAKEN` if the surface has a receiver or a writer already, or a misuse.
 */
dibs_code dibs_writer_init(void *storage, size_t size, dibs_surface *surface, dibs_writer **writer);

/**
 * Starts a frame, and discards an unfinished one.
 *
 * @return `DIBS_CODE_OK`, or a misuse.
 */
dibs_code dibs_writer_begin(dibs_writer *writer);

/**
 * Stores the positions of the next rows.
 *
 * Cost: linear in the positions.
 *
 * @param writer     The writer.
 * @param positions  x, y and z (mm) of each vertex, in the tree's order of rows. Copied.
 * @param count      Their number.
 * @return `DIBS_CODE_OK`; `DIBS_CODE_VERTEX_COUNT` if these are more rows than the frame lacks: nothing is stored; or
 *         a misuse.
 */
dibs_code dibs_writer_push(dibs_writer *writer,
                           const float *positions,
                           uint32_t count);

/**
 * Publishes the frame.
 *
 * Cost: with a tree linear in its triangles, otherwise a few instructions.
 *
 * @param writer          The writer.
 * @param tree            The surface's tree, to measure the stretch, which makes queries cheaper; or null: queries
 *                        then assume the tree's limit.
 * @param epoch           Number of the frame.
 * @param received        Its time on the reader's clock, in ms; wraps.
 * @param position_error  Largest error (mm, at least 0) of a vertex position.
 * @return `DIBS_CODE_OK`; `DIBS_CODE_VERTEX_COUNT` while vertices are missing; `DIBS_CODE_HELD` while the published
 *         frame is read: nothing is lost, call again; `DIBS_CODE_STRETCH_EXCEEDED` if distances on this frame could be
 *         wrong, and the other codes of `dibs_frame_measure`; `DIBS_CODE_ARGUMENT` for an error that is negative or
 *         not finite; or a misuse.
 */
dibs_code dibs_writer_publish(dibs_writer *writer,
                              dibs_tree *tree,
                              uint32_t epoch,
                              uint32_t received,
                              float position_error);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* DIBS_H */
