/**
 * @file
 * dibs for C++20: objects that own their storage, spans in place of pointers, no exceptions.
 *
 * `init` makes an object of what its function in `dibs.h` takes after the storage, and returns a code, as every call does.
 * Objects convert to those of `dibs.h`, for its other functions, and do not move: the library keeps their addresses.
 */
#ifndef DIBS_HPP
#define DIBS_HPP

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "dibs.h"

namespace dibs {

using Options = const dibs_options *;
using Bytes = std::span<const std::uint8_t>;
using Tools = std::span<const dibs_tool>;

/** One sentence about a code. */
inline std::string_view text(dibs_code code) { return dibs_code_text(code); }

/** The length of both spans; 0, which every call refuses, if they differ. */
inline std::uint32_t common(auto one, auto other) {
    return one.size() == other.size() ? static_cast<std::uint32_t>(one.size()) : 0;
}

/** Storage of an object, and its address: null before it was made, which every call reports. */
template <class T, std::size_t Size, auto Make>
class Object {
public:
    Object() = default;
    Object(const Object &) = delete;
    Object &operator=(const Object &) = delete;
    operator T *() const { return object; }
    dibs_code init(const auto &...with) {
        object = nullptr;
        return Make(storage.data(), storage.size(), with..., &object);
    }

private:
    alignas(DIBS_ALIGNMENT) std::array<unsigned char, Size> storage;
    T *object = nullptr;
};

/** A validated tree. The bytes outlive it. */
struct Tree : Object<dibs_tree, DIBS_TREE_SIZE, dibs_tree_init> {
    dibs_code init(Bytes tree) { return Object::init(tree.data(), tree.size()); }
};
/** The surface at one moment, released with this object. */
struct Frame : Object<dibs_frame, DIBS_FRAME_SIZE, dibs_frame_init> {
    ~Frame() { release(); }
    dibs_code release() { return dibs_frame_release(*this); }
    /** x, y and z (mm) of each vertex, which outlive the frame or its release. */
    dibs_code set(std::span<const float> positions, float error = 0.0f) {
        return dibs_frame_set_vertices(*this, positions.data(), static_cast<std::uint32_t>(positions.size() / 3), error);
    }
};
/** Contacts of a query, a scene or a tracker. */
struct Contacts : Object<dibs_contacts, DIBS_CONTACTS_SIZE, dibs_contacts_init> {
    /** Rows for a solver, in `rows`: the first of `room`. */
    dibs_code rows(dibs_vec3 origin, float stand_off, float gain, std::span<dibs_row> room, std::span<dibs_row> &rows) {
        std::size_t count = 0;
        const dibs_code code = dibs_contacts_rows(*this, origin, stand_off, gain, room.size(), room.data(), &count);
        rows = room.first(count);
        return code;
    }
};
/** The closest pair, and the contacts. */
struct Query : Object<dibs_query, DIBS_QUERY_SIZE, dibs_query_init> {
    dibs_code closest(dibs_frame *frame, const dibs_tool &tool, dibs_proximity &found, Options options = nullptr) {
        return dibs_query_closest(*this, frame, &tool, options, &found);
    }
    dibs_code contacts(dibs_frame *frame, const dibs_tool &tool, float margin, dibs_contacts *list,
                       Options options = nullptr) {
        return dibs_query_contacts(*this, frame, &tool, margin, options, list, nullptr);
    }
};
/** A chain of tools and surfaces: a query and a frame for each. */
struct Scene : dibs_scene {
    Scene(std::span<dibs_query *const> queries, std::span<dibs_frame *const> frames, Tools tools)
        : dibs_scene{queries.data(), frames.data(), common(queries, frames), tools.data(), common(tools, tools)} {}
    dibs_code closest(dibs_closest &found, Options options = nullptr) const {
        return dibs_scene_closest(this, options, &found);
    }
    dibs_code contacts(float margin, dibs_contacts *list, Options options = nullptr) const {
        return dibs_scene_contacts(this, margin, options, list, nullptr);
    }
};
/** The closest pair and the contacts from tick to tick, on a copy of a surface of at most so many vertices. */
template <std::uint32_t Vertices>
struct Tracker : Object<dibs_tracker, DIBS_TRACKER_SIZE(Vertices), dibs_tracker_init> {
    dibs_code set(dibs_frame *frame) { return dibs_tracker_set_frame(*this, frame); }
    dibs_code closest(const dibs_tool &tool, dibs_proximity &found, Options options = nullptr) {
        return dibs_tracker_closest(*this, &tool, options, &found, nullptr);
    }
    dibs_code contacts(const dibs_tool &tool, float margin, dibs_contacts *list, Options options = nullptr) {
        return dibs_tracker_contacts(*this, &tool, margin, options, list, nullptr, nullptr);
    }
};
/** The closest pair of several trackers, each with a tool. */
inline dibs_code closest_of(std::span<dibs_tracker *const> trackers, Tools tools, dibs_tracked &found,
                            Options options = nullptr) {
    return dibs_tracker_closest_of(trackers.data(), tools.data(), common(trackers, tools), options, &found);
}
/** Buffers for so many vertices. */
template <std::uint32_t Vertices>
struct Surface : Object<dibs_surface, DIBS_SURFACE_SIZE(Vertices), dibs_surface_init> {
    dibs_code init() { return Surface::Object::init(Vertices); }
};
/** The bus's end of a surface. */
struct Receiver : Object<dibs_receiver, DIBS_RECEIVER_SIZE, dibs_receiver_init> {
    dibs_code accept(Bytes packet, std::uint32_t now, dibs_progress *progress = nullptr) {
        return dibs_receiver_accept(*this, packet.data(), packet.size(), now, progress);
    }
    dibs_code advance(std::uint32_t work, dibs_advance *outcome = nullptr) {
        return dibs_receiver_advance(*this, work, outcome);
    }
};
/** The control tick's end of a surface. */
struct Reader : Object<dibs_reader, DIBS_READER_SIZE, dibs_reader_init> {
    dibs_code latest(std::uint32_t now, std::uint32_t limit, dibs_frame *frame, dibs_age *age = nullptr) {
        return dibs_reader_latest(*this, now, limit, frame, age);
    }
};
/** The fail-safe machine. */
struct FailSafe : Object<dibs_failsafe, DIBS_FAILSAFE_SIZE, dibs_failsafe_init> {
    dibs_code step(const dibs_observation &seen, dibs_verdict &verdict) {
        return dibs_failsafe_step(*this, &seen, &verdict);
    }
};

} // namespace dibs

#endif
