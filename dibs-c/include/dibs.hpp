/**
 * @file
 * dibs for C++20: objects that own their storage, spans in place of pointers, no exceptions.
 *
 * An object is made by `init`, which returns a code, as every other call does; the rest of the interface is `dibs.h`'s, to
 * which each object converts. Objects do not move: the library keeps their addresses.
 */
#ifndef DIBS_HPP
#define DIBS_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "dibs.h"

namespace dibs {

/** One sentence about a code. */
inline std::string_view text(dibs_code code) { return dibs_code_text(code); }

/** Storage of an object, and its address once it was made. */
template <class T, std::size_t Size>
class Object {
public:
    Object() = default;
    Object(const Object &) = delete;
    Object &operator=(const Object &) = delete;

    /** The C interface's object; null before it was made, which every call reports. */
    operator T *() const { return object; }

protected:
    /** Makes the object by a function of `dibs.h`. */
    template <class Function, class... Arguments>
    dibs_code make(Function function, Arguments... arguments) {
        object = nullptr;
        return function(storage.data(), storage.size(), arguments..., &object);
    }

private:
    alignas(DIBS_ALIGNMENT) std::array<unsigned char, Size> storage;
    T *object = nullptr;
};

/** A validated tree. The bytes outlive it. */
struct Tree : Object<dibs_tree, DIBS_TREE_SIZE> {
    dibs_code init(std::span<const std::uint8_t> bytes) { return make(dibs_tree_init, bytes.data(), bytes.size()); }
};

/** The surface at one moment, released with this object. */
struct Frame : Object<dibs_frame, DIBS_FRAME_SIZE> {
    ~Frame() { release(); }

    dibs_code init() { return make(dibs_frame_init); }

    /** x, y and z (mm) of each vertex, which outlive the frame or its release. */
    dibs_code set(std::span<const float> positions, float error = 0.0f) {
        return dibs_frame_set_vertices(*this, positions.data(), static_cast<std::uint32_t>(positions.size() / 3), error);
    }

    dibs_code release() { return dibs_frame_release(*this); }
};

/** The closest pair, and the contacts. */
struct Query : Object<dibs_query, DIBS_QUERY_SIZE> {
    dibs_code init(dibs_tree *tree) { return make(dibs_query_init, tree); }

    dibs_code closest(dibs_frame *frame, const dibs_tool &tool, dibs_proximity &found, const dibs_options *options = nullptr) {
        return dibs_query_closest(*this, frame, &tool, options, &found);
    }

    dibs_code contacts(dibs_frame *frame, const dibs_tool &tool, float margin, dibs_contacts *list,
                       const dibs_options *options = nullptr) {
        return dibs_query_contacts(*this, frame, &tool, margin, options, list, nullptr);
    }
};

/** A list of contacts. */
struct Contacts : Object<dibs_contacts, DIBS_CONTACTS_SIZE> {
    dibs_code init() { return make(dibs_contacts_init); }

    /** Rows for a solver, as many of `room` as are returned in `rows`. */
    dibs_code rows(dibs_vec3 origin, float stand_off, float gain, std::span<dibs_row> room, std::span<dibs_row> &rows) {
        std::size_t count = 0;
        const dibs_code code = dibs_contacts_rows(*this, origin, stand_off, gain, room.size(), room.data(), &count);
        rows = room.first(count);
        return code;
    }
};

/** Buffers for so many vertices. */
template <std::uint32_t Vertices>
struct Surface : Object<dibs_surface, DIBS_SURFACE_SIZE(Vertices)> {
    dibs_code init() { return this->make(dibs_surface_init, Vertices); }
};

/** The bus's end of a surface. */
struct Receiver : Object<dibs_receiver, DIBS_RECEIVER_SIZE> {
    dibs_code init(dibs_surface *surface, dibs_tree *tree, const dibs_surface_limits &limits) {
        return make(dibs_receiver_init, surface, tree, &limits);
    }

    dibs_code accept(std::span<const std::uint8_t> packet, std::uint32_t now, dibs_progress *progress = nullptr) {
        return dibs_receiver_accept(*this, packet.data(), packet.size(), now, progress);
    }

    dibs_code advance(std::uint32_t work, dibs_advance *outcome = nullptr) {
        return dibs_receiver_advance(*this, work, outcome);
    }
};

/** The control tick's end of a surface. */
struct Reader : Object<dibs_reader, DIBS_READER_SIZE> {
    dibs_code init(dibs_surface *surface) { return make(dibs_reader_init, surface); }

    dibs_code latest(std::uint32_t now, std::uint32_t limit, dibs_frame *frame, dibs_age *age = nullptr) {
        return dibs_reader_latest(*this, now, limit, frame, age);
    }
};

/** The closest pair from tick to tick, on a copy of a surface of at most so many vertices. */
template <std::uint32_t Vertices>
struct Tracker : Object<dibs_tracker, DIBS_TRACKER_SIZE(Vertices)> {
    dibs_code init(dibs_tree *tree) { return this->make(dibs_tracker_init, tree); }

    dibs_code set(dibs_frame *frame) { return dibs_tracker_set_frame(*this, frame); }

    dibs_code closest(const dibs_tool &tool, dibs_proximity &found, const dibs_options *options = nullptr) {
        return dibs_tracker_closest(*this, &tool, options, &found, nullptr);
    }
};

/** The fail-safe machine. */
struct FailSafe : Object<dibs_failsafe, DIBS_FAILSAFE_SIZE> {
    dibs_code init(const dibs_limits &limits) { return make(dibs_failsafe_init, &limits); }

    dibs_code step(const dibs_observation &seen, dibs_verdict &verdict) { return dibs_failsafe_step(*this, &seen, &verdict); }
};

} // namespace dibs

#endif
