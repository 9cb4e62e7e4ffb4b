/**
 * @file
 * dibs for C++20: objects that own their storage, spans in place of pointers, no exceptions. Every call returns a code.
 * `init` makes an object of what its function in `dibs.h` takes after the storage. Objects convert to those of `dibs.h`,
 * for its other functions, and do not move: the library keeps their addresses.
 */
#pragma once
#include <span>
#include <string_view>
#include "dibs.h"

namespace dibs {
using Code = dibs_code;
using Options = const dibs_options *;
using Tools = std::span<const dibs_tool>;
/** One sentence about a code. */
inline std::string_view text(Code code) { return dibs_code_text(code); }
/** The length of both spans; 0, which every call refuses, if they differ. */
inline uint32_t common(auto one, auto other) { return one.size() == other.size() ? uint32_t(one.size()) : 0; }

/** Storage of an object, and its address: null before it is made, which every call reports. */
template <class T, size_t Size, auto Make, auto... First> class Object {
    alignas(DIBS_ALIGNMENT) unsigned char storage[Size];
    T *object = nullptr;
public:
    /** Deletes every move and copy. */
    Object &operator=(Object &&) = delete;
    operator T *() const { return object; }
    Code init(const auto &...with) { return Make(storage, Size, First..., with..., &object); }
};
/** A validated tree. The bytes outlive it. */
struct Tree : Object<dibs_tree, DIBS_TREE_SIZE, dibs_tree_init> {
    Code init(std::span<const uint8_t> tree) { return Object::init(tree.data(), tree.size()); }
};
/** The surface at one moment, released with this object. */
struct Frame : Object<dibs_frame, DIBS_FRAME_SIZE, dibs_frame_init> {
    ~Frame() { release(); }
    Code release() { return dibs_frame_release(*this); }
    /** x, y and z (mm) of each vertex, which outlive the frame or its release. */
    Code set(std::span<const float> positions, float error = 0.0f) {
        return dibs_frame_set_vertices(*this, positions.data(), uint32_t(positions.size() / 3), error);
    }
    /** x, y and z (mm) of each node that carries the surface, which outlive the frame or its release. */
    Code set_nodes(dibs_tree *tree, std::span<const float> positions, float error = 0.0f) {
        return dibs_frame_set_nodes(*this, tree, positions.data(), uint32_t(positions.size() / 3), error);
    }
};
/** Contacts of a query, a scene or a tracker. */
struct Contacts : Object<dibs_contacts, DIBS_CONTACTS_SIZE, dibs_contacts_init> {
    /** Rows for a solver, in `rows`: the first of `room`. */
    Code rows(dibs_vec3 origin, float stand_off, float gain, std::span<dibs_row> room, std::span<dibs_row> &rows) {
        size_t count = 0;
        const Code code = dibs_contacts_rows(*this, origin, stand_off, gain, room.size(), room.data(), &count);
        rows = room.first(count);
        return code;
    }
};
/** The closest pair, and the contacts. */
struct Query : Object<dibs_query, DIBS_QUERY_SIZE, dibs_query_init> {
    Code closest(dibs_frame *frame, const dibs_tool &tool, dibs_proximity &found, Options options = {}) {
        return dibs_query_closest(*this, frame, &tool, options, &found);
    }
    Code contacts(dibs_frame *frame, const dibs_tool &tool, float margin, dibs_contacts *list, Options options = {}) {
        return dibs_query_contacts(*this, frame, &tool, margin, options, list, nullptr);
    }
};
/** A chain of tools and surfaces: a query and a frame for each. */
struct Scene : dibs_scene {
    Scene(std::span<dibs_query *const> queries, std::span<dibs_frame *const> frames, Tools tools)
        : dibs_scene{queries.data(), frames.data(), common(queries, frames), tools.data(), common(tools, tools)} {}
    Code closest(dibs_closest &found, Options options = {}) const { return dibs_scene_closest(this, options, &found); }
    Code contacts(float margin, dibs_contacts *list, Options options = {}) const {
        return dibs_scene_contacts(this, margin, options, list, nullptr);
    }
};
/** The closest pair and the contacts from tick to tick, on a copy of a surface of at most so many vertices. */
template <uint32_t Vertices> struct Tracker : Object<dibs_tracker, DIBS_TRACKER_SIZE(Vertices), dibs_tracker_init> {
    Code set(dibs_frame *frame) { return dibs_tracker_set_frame(*this, frame); }
    Code closest(const dibs_tool &tool, dibs_tracked &found, Options options = {}) {
        return dibs_tracker_closest(*this, &tool, options, &found);
    }
    /** On a reader's frame, without a copy of it. */
    Code closest_on(dibs_frame *frame, const dibs_tool &tool, dibs_tracked &found, Options options = {}) {
        return dibs_tracker_closest_on(*this, frame, &tool, options, &found);
    }
    Code contacts(const dibs_tool &tool, float margin, dibs_contacts *list, Options options = {}) {
        return dibs_tracker_contacts(*this, &tool, margin, options, list, nullptr);
    }
};
/** The closest pair of several trackers, each with a tool. */
inline Code closest_of(std::span<dibs_tracker *const> trackers, Tools tools, dibs_tracked &pair, Options options = {}) {
    return dibs_tracker_closest_of(trackers.data(), tools.data(), common(trackers, tools), options, &pair);
}
/** A filter of commands: the motion nearest to a commanded one that keeps a chain of tools out of the tissue. */
struct Filter : dibs_filter {
    Filter(float stand_off, float speed) : dibs_filter(dibs_filter_of(stand_off, speed)) {}
    /** On the trackers' own surfaces, or on a reader's `frame`. */
    Code admit(std::span<dibs_tracker *const> trackers, Tools tools, const dibs_motion &command, float period,
               const dibs_uncertainty &uncertainty, dibs_admitted &admitted, std::span<const dibs_motion_row> rows = {},
               dibs_frame *frame = nullptr) const {
        return dibs_filter_admit(this, trackers.data(), frame, tools.data(), common(trackers, tools), &command, period,
                                 &uncertainty, rows.data(), uint32_t(rows.size()), &admitted);
    }
};
/** Buffers for so many vertices. */
template <uint32_t Vertices> using Surface = Object<dibs_surface, DIBS_SURFACE_SIZE(Vertices), dibs_surface_init, Vertices>;
/** Buffers for so many vertices, with the frame before, for a bus and a guard. */
template <uint32_t Vertices>
using GuardedSurface = Object<dibs_surface, DIBS_GUARDED_SIZE(Vertices), dibs_surface_init, Vertices>;
/** The bus's end of a guarded surface. */
struct Bus : Object<dibs_bus, DIBS_BUS_SIZE, dibs_bus_init> {
    Code receive(std::span<const uint8_t> bytes, uint32_t now) {
        return dibs_bus_receive(*this, bytes.data(), bytes.size(), now);
    }
    Code packet(std::span<const uint8_t> packet, uint32_t now, dibs_progress *progress = nullptr) {
        return dibs_bus_packet(*this, packet.data(), packet.size(), now, progress);
    }
    /** A frame of this process: x, y and z of each vertex, in the mesh's order. */
    Code frame(std::span<const float> positions, uint32_t captured, uint32_t now) {
        return dibs_bus_frame(*this, positions.data(), uint32_t(positions.size() / 3), captured, now);
    }
    /** The same, with the mesh as a whole at a pose. */
    Code frame_at(std::span<const float> positions, const dibs_pose &pose, uint32_t captured, uint32_t now) {
        return dibs_bus_frame_at(*this, positions.data(), uint32_t(positions.size() / 3), &pose, captured, now);
    }
    Code work(uint32_t work, dibs_advance *outcome = nullptr) { return dibs_bus_work(*this, work, outcome); }
};
/** The control tick's end of a guarded surface. */
struct Guard : Object<dibs_guard, DIBS_GUARD_SIZE, dibs_guard_init> {
    Code closest(const dibs_tool &tool, uint32_t now, dibs_answer &answer) {
        return dibs_guard_closest(*this, &tool, now, &answer);
    }
    Code contacts(const dibs_tool &tool, float margin, uint32_t now, dibs_contacts *list, dibs_answer &answer) {
        return dibs_guard_contacts(*this, &tool, margin, now, list, &answer);
    }
    Code admit(const dibs_filter &filter, const dibs_tool &tool, const dibs_motion &command, uint32_t now,
               dibs_admitted &admitted, dibs_answer *answer = nullptr) {
        return dibs_guard_admit(*this, &filter, &tool, &command, now, answer, &admitted);
    }
    Code acknowledge() { return dibs_guard_acknowledge(*this); }
};
/** Sends a surface's frames to a controller, until it goes out of scope. In the library for a computer alone. */
struct Sender : Object<dibs_sender, DIBS_SENDER_SIZE, dibs_sender_init> {
    ~Sender() { dibs_sender_close(*this); }
    /** `target` is text that a zero ends, as for `dibs_sender_init`. */
    Code init(dibs_tree *tree, const char *target, const dibs_sender_settings *settings = nullptr) {
        return Object::init(tree, target, settings);
    }
    /** x, y and z of each vertex, in the mesh's order, so many milliseconds ago. */
    Code send(std::span<const float> positions, uint32_t age = DIBS_AGE_UNKNOWN, dibs_sent *sent = nullptr) {
        return dibs_sender_send(*this, positions.data(), uint32_t(positions.size() / 3), age, sent);
    }
    /** The same, with the mesh as a whole at a pose. */
    Code send_at(std::span<const float> positions, const dibs_pose &pose, uint32_t age, dibs_sent *sent = nullptr) {
        return dibs_sender_send_at(*this, positions.data(), uint32_t(positions.size() / 3), &pose, age, sent);
    }
    Code poll() { return dibs_sender_poll(*this); }
};
/** Frames of positions that the caller has. */
struct Writer : Object<dibs_writer, DIBS_WRITER_SIZE, dibs_writer_init> {
    Code begin() { return dibs_writer_begin(*this); }
    Code push(std::span<const float> positions) {
        return dibs_writer_push(*this, positions.data(), uint32_t(positions.size() / 3));
    }
    Code publish(dibs_tree *tree, uint32_t epoch, uint32_t received, float error = 0.0f) {
        return dibs_writer_publish(*this, tree, epoch, received, error);
    }
};
/** The bus's end of a surface. */
struct Receiver : Object<dibs_receiver, DIBS_RECEIVER_SIZE, dibs_receiver_init> {
    Code accept(std::span<const uint8_t> packet, uint32_t now, dibs_progress *progress = nullptr) {
        return dibs_receiver_accept(*this, packet.data(), packet.size(), now, progress);
    }
    Code advance(uint32_t work, dibs_advance *outcome = nullptr) { return dibs_receiver_advance(*this, work, outcome); }
};
/** The control tick's end of a surface. */
struct Reader : Object<dibs_reader, DIBS_READER_SIZE, dibs_reader_init> {
    Code latest(uint32_t now, uint32_t limit, dibs_frame *frame, dibs_age *age = nullptr) {
        return dibs_reader_latest(*this, now, limit, frame, age);
    }
};
/** The fail-safe machine. */
struct FailSafe : Object<dibs_failsafe, DIBS_FAILSAFE_SIZE, dibs_failsafe_init> {
    Code step(const dibs_observation &seen, dibs_verdict &verdict) { return dibs_failsafe_step(*this, &seen, &verdict); }
};
} // namespace dibs
