/**
 * @file
 * dibs for C++17: objects that own their storage, spans in place of pointers, no exceptions. Every call returns a code.
 * `init` makes an object of what its function in `dibs.h` takes after the storage. Objects convert to those of `dibs.h`,
 * for its other functions, and do not move: the library keeps their addresses.
 */
#pragma once
#include <iterator>
#include <new>
#include <string_view>
#include <type_traits>
#include <utility>
#include "dibs.h"

namespace dibs {
using Code = dibs_code;
using Options = const dibs_options *;
/** Elements side by side in somebody's memory: of a vector, an array, `std::span`, or an address and a number. */
template <class T> class Span {
    T *first_element = nullptr;
    size_t count = 0;
public:
    constexpr Span() = default;
    constexpr Span(T *first, size_t count) : first_element(first), count(count) {}
    /** Of a container that outlives it. */
    template <class C, class U = std::remove_pointer_t<decltype(std::data(std::declval<C &>()))>,
              class = std::enable_if_t<std::is_convertible_v<U (*)[], T (*)[]>>>
    constexpr Span(C &&of) : first_element(std::data(of)), count(std::size(of)) {}
    constexpr T *data() const { return first_element; }
    constexpr size_t size() const { return count; }
    constexpr T *begin() const { return first_element; }
    constexpr T *end() const { return first_element + count; }
    constexpr T &operator[](size_t at) const { return first_element[at]; }
};
using Tools = Span<const dibs_tool>;
/** One sentence about a code. */
inline std::string_view text(uint32_t code) { return dibs_code_text(code); }
/** The length of both spans; 0, which every call refuses, if they differ. */
template <class One, class Other> uint32_t common(One one, Other other) {
    return one.size() == other.size() ? uint32_t(one.size()) : 0;
}

/** Storage of an object, and its address: null before it is made, which every call reports. */
template <class T, size_t Size, auto Make, auto... First> class Object {
    alignas(DIBS_ALIGNMENT) unsigned char storage[Size];
    T *object = nullptr;
public:
    /** Deletes every move and copy. */
    Object &operator=(Object &&) = delete;
    operator T *() const { return object; }
    template <class... With> Code init(const With &...with) { return Make(storage, Size, First..., with..., &object); }
protected:
    /** The same by another function. */
    template <auto Other, class... With> Code init_by(const With &...with) { return Other(storage, Size, with..., &object); }
};
/** A validated tree. The bytes outlive it. */
struct Tree : Object<dibs_tree, DIBS_TREE_SIZE, dibs_tree_init> {
    Code init(Span<const uint8_t> tree) { return Object::init(tree.data(), tree.size()); }
    /** The number in the mesh's file of the vertex in a row, such as one of an answer's `corners`. */
    Code vertex_number(uint32_t row, uint32_t &number) { return dibs_tree_vertex_number(*this, row, &number); }
    /** Copies the positions, or velocities, of the mesh file's vertices into the tree's order, which a frame needs: `rows`
     *  are the first of `room`, in which as many as `values` are enough. */
    Code to_rows(Span<const float> values, Span<float> room, Span<float> &rows) {
        dibs_tree_facts facts;
        Code code = dibs_tree_get_facts(*this, &facts);
        if (code != DIBS_CODE_OK) return code;
        code = dibs_tree_to_rows(*this, values.data(), uint32_t(values.size() / 3), room.data(), uint32_t(room.size() / 3));
        if (code == DIBS_CODE_OK) rows = {room.data(), size_t(facts.vertices) * 3};
        return code;
    }
};
/** The surface at one moment, released with this object. */
struct Frame : Object<dibs_frame, DIBS_FRAME_SIZE, dibs_frame_init> {
    ~Frame() { release(); }
    Code release() { return dibs_frame_release(*this); }
    /** x, y and z (mm) of each vertex, which outlive the frame or its release. In the tree's order (`Tree::to_rows`): in the
     *  file's order distances are wrong, which `measure` notices. */
    Code set(Span<const float> positions, float error = 0.0f) {
        return dibs_frame_set_vertices(*this, positions.data(), uint32_t(positions.size() / 3), error);
    }
    /** x, y and z (mm) of each node that carries the surface, which outlive the frame or its release. */
    Code set_nodes(dibs_tree *tree, Span<const float> positions, float error = 0.0f) {
        return dibs_frame_set_nodes(*this, tree, positions.data(), uint32_t(positions.size() / 3), error);
    }
    /** Measures the stretch: queries are cheaper then, and a surface stretched beyond the tree's limit is refused. */
    Code measure(dibs_tree *tree, float *stretch = nullptr) { return dibs_frame_measure(*this, tree, stretch); }
};
/** Contacts of a query, a scene or a tracker. */
struct Contacts : Object<dibs_contacts, DIBS_CONTACTS_SIZE, dibs_contacts_init> {
    /** Rows for a solver, in `rows`: the first of `room`. */
    Code rows(dibs_vec3 origin, float stand_off, float gain, Span<dibs_row> room, Span<dibs_row> &rows) {
        size_t count = 0;
        const Code code = dibs_contacts_rows(*this, origin, stand_off, gain, room.size(), room.data(), &count);
        rows = {room.data(), count};
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
    Scene(Span<dibs_query *const> queries, Span<dibs_frame *const> frames, Tools tools)
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
    /** Whether tool and surface come closer than a margin between two ticks, and when first. */
    Code sweep(const dibs_sweep &sweep, dibs_swept &swept, Options options = {}) {
        return dibs_tracker_sweep(*this, &sweep, options, &swept);
    }
};
/** The closest pair of several trackers, each with a tool. */
inline Code closest_of(Span<dibs_tracker *const> trackers, Tools tools, dibs_tracked &pair, Options options = {}) {
    return dibs_tracker_closest_of(trackers.data(), tools.data(), common(trackers, tools), options, &pair);
}
/** An account of the energy that a wall's force gives to the hand, which bounds it. */
struct Account : Object<dibs_account, DIBS_ACCOUNT_SIZE, dibs_account_init> {
    /** The force to apply for the next period, at every tick. */
    Code pass(dibs_vec3 force, dibs_vec3 velocity, float period, dibs_vec3 &applied) {
        return dibs_account_pass(*this, force, velocity, period, &applied);
    }
    Code balance(float &balance) { return dibs_account_balance(*this, &balance); }
};
/** A filter of commands: the motion nearest to a commanded one that keeps a chain of tools out of the tissue. */
struct Filter : dibs_filter {
    Filter(float stand_off, float speed, Span<const dibs_stand_off_of> of_labels = {})
        : dibs_filter(dibs_filter_of(stand_off, speed)) {
        label_count = uint32_t(of_labels.size());
        for (size_t at = 0; at < of_labels.size() && at < DIBS_FILTER_LABELS; at++) {
            labels[at] = of_labels.data()[at];
        }
    }
    /** On the trackers' own surfaces, or on a reader's `frame`. */
    Code admit(Span<dibs_tracker *const> trackers, Tools tools, const dibs_rigid_motion &command, float period,
               const dibs_uncertainty &uncertainty, dibs_admitted_motion &admitted,
               Span<const dibs_motion_row> rows = {}, dibs_frame *frame = nullptr) const {
        return dibs_filter_admit(this, trackers.data(), frame, tools.data(), common(trackers, tools), &command, period,
                                 &uncertainty, rows.data(), uint32_t(rows.size()), &admitted);
    }
};
/** Buffers for so many vertices. */
template <uint32_t Vertices> using Surface = Object<dibs_surface, DIBS_SURFACE_SIZE(Vertices), dibs_surface_init, Vertices>;
/** Buffers for so many vertices, with the frame before, for a bus and a guard. */
template <uint32_t Vertices>
using GuardedSurface = Object<dibs_surface, DIBS_GUARDED_SIZE(Vertices), dibs_surface_init, Vertices>;
/** A key of `DIBS_KEY` bytes. */
using Key = const uint8_t (&)[DIBS_KEY];
/** The tags that a receiver demands, and its challenge, drawn anew at each start. It outlives its receiver. */
struct Tags : Object<dibs_tags, DIBS_TAGS_SIZE, dibs_tags_init> {
    Code init(Key key, uint32_t receiver, uint64_t challenge) { return Object::init(&key[0], receiver, challenge); }
};
/** The bus's end of a guarded surface: its calls. */
template <class Base> struct BusOf : Base {
    Code receive(Span<const uint8_t> bytes, uint32_t now) {
        return dibs_bus_receive(*this, bytes.data(), bytes.size(), now);
    }
    Code packet(Span<const uint8_t> packet, uint32_t now, dibs_progress *progress = nullptr) {
        return dibs_bus_packet(*this, packet.data(), packet.size(), now, progress);
    }
    /** A frame of this process: x, y and z of each vertex, in the mesh's order. */
    Code frame(Span<const float> positions, uint32_t captured, uint32_t now) {
        return dibs_bus_frame(*this, positions.data(), uint32_t(positions.size() / 3), captured, now);
    }
    /** The same, for a mesh at a rigid pose. */
    Code frame_at(Span<const float> positions, const dibs_pose &pose, uint32_t captured, uint32_t now) {
        return dibs_bus_frame_at(*this, positions.data(), uint32_t(positions.size() / 3), &pose, captured, now);
    }
    /** The same, by the weights of the tree's displacement modes, at a pose or where the mesh's file has it. */
    Code weights(dibs_tree *tree, Span<const float> weights, const dibs_pose *pose, uint32_t captured, uint32_t now) {
        return dibs_bus_weights(*this, tree, weights.data(), uint32_t(weights.size()), pose, captured, now);
    }
    Code work(uint32_t work, dibs_advance *outcome = nullptr) { return dibs_bus_work(*this, work, outcome); }
};
struct Bus : BusOf<Object<dibs_bus, DIBS_BUS_SIZE, dibs_bus_init>> {
    Code init(dibs_surface *surface, dibs_tree *tree, const dibs_guard_limits *limits) {
        return Object::init(surface, tree, limits);
    }
    /** Of packets with tags alone. */
    Code init(dibs_surface *surface, dibs_tree *tree, const dibs_guard_limits *limits, dibs_tags *tags) {
        return init_by<dibs_bus_init_with_tags>(surface, tree, limits, tags);
    }
};
/** The control tick's end of a guarded surface: its calls. */
template <class Base> struct GuardOf : Base {
    Code closest(const dibs_tool &tool, uint32_t now, dibs_answer &answer) {
        return dibs_guard_closest(*this, &tool, now, &answer);
    }
    Code contacts(const dibs_tool &tool, float margin, uint32_t now, dibs_contacts *list, dibs_answer &answer) {
        return dibs_guard_contacts(*this, &tool, margin, now, list, &answer);
    }
    Code admit(const dibs_filter &filter, const dibs_tool &tool, const dibs_rigid_motion &command, uint32_t now,
               dibs_admitted_motion &admitted, dibs_answer *answer = nullptr) {
        return dibs_guard_admit(*this, &filter, &tool, &command, now, answer, &admitted);
    }
    Code acknowledge() { return dibs_guard_acknowledge(*this); }
};
using Guard = GuardOf<Object<dibs_guard, DIBS_GUARD_SIZE, dibs_guard_init>>;
/** An object whose storage is somebody else's. */
template <class T> struct Handle {
    T *object = nullptr;
    operator T *() const { return object; }
};
/** Bus and guard of a tree with any number of vertices, in memory of the free store. */
class Loop {
    static constexpr std::align_val_t Alignment{DIBS_ALIGNMENT};
    void *memory = nullptr;
public:
    BusOf<Handle<dibs_bus>> bus;
    GuardOf<Handle<dibs_guard>> guard;
    /** The bytes outlive the loop. `DIBS_CODE_STORAGE_SIZE` where there is no memory. A second call begins anew. */
    Code init(Span<const uint8_t> tree, const dibs_guard_limits &limits) {
        return start(tree, [&](auto... given) { return dibs_start(given..., &limits, &bus.object, &guard.object); });
    }
    /** Of packets with tags alone. */
    Code init(Span<const uint8_t> tree, const dibs_guard_limits &limits, dibs_tags *tags) {
        return start(tree, [&](auto... given) {
            return dibs_start_with_tags(given..., &limits, tags, &bus.object, &guard.object);
        });
    }
    /** Deletes every move and copy. */
    Loop &operator=(Loop &&) = delete;
    Loop() = default;
    ~Loop() { release(); }
private:
    template <class Start> Code start(Span<const uint8_t> tree, Start make) {
        release();
        Tree checked;
        dibs_tree_facts facts;
        Code code = checked.init(tree);
        if (code == DIBS_CODE_OK) code = dibs_tree_get_facts(checked, &facts);
        if (code != DIBS_CODE_OK) return code;
        const size_t size = DIBS_START_SIZE(facts.rows);
        memory = operator new(size, Alignment, std::nothrow);
        if (memory == nullptr) return DIBS_CODE_STORAGE_SIZE;
        return make(memory, size, tree.data(), tree.size());
    }
    void release() {
        bus.object = nullptr;
        guard.object = nullptr;
        operator delete(memory, Alignment);
        memory = nullptr;
    }
};
/** Sends a surface's frames to a controller, until it goes out of scope. In the library for a computer alone. */
struct Sender : Object<dibs_sender, DIBS_SENDER_SIZE, dibs_sender_init> {
    ~Sender() { dibs_sender_close(*this); }
    /** `target` is text that a zero ends, as for `dibs_sender_init`. */
    Code init(dibs_tree *tree, const char *target, const dibs_sender_settings *settings = nullptr) {
        return Object::init(tree, target, settings);
    }
    /** For a receiver that demands tags. */
    Code init(dibs_tree *tree, const char *target, Key key, uint32_t receiver, const dibs_sender_settings *settings = nullptr) {
        return init_by<dibs_sender_init_with_key>(tree, target, settings, &key[0], receiver);
    }
    /** The challenge that the receiver was given, for a line without a way back. */
    Code challenge(uint64_t challenge) { return dibs_sender_challenge(*this, challenge); }
    /** x, y and z of each vertex, in the mesh's order, so many milliseconds ago. */
    Code send(Span<const float> positions, uint32_t age = DIBS_AGE_UNKNOWN, dibs_sent_frame *sent = nullptr) {
        return dibs_sender_send(*this, positions.data(), uint32_t(positions.size() / 3), age, sent);
    }
    /** The same, for a mesh at a rigid pose. */
    Code send_at(Span<const float> positions, const dibs_pose &pose, uint32_t age, dibs_sent_frame *sent = nullptr) {
        return dibs_sender_send_at(*this, positions.data(), uint32_t(positions.size() / 3), &pose, age, sent);
    }
    Code poll() { return dibs_sender_poll(*this); }
};
/** Frames of positions that the caller has. */
struct Writer : Object<dibs_writer, DIBS_WRITER_SIZE, dibs_writer_init> {
    Code begin() { return dibs_writer_begin(*this); }
    Code push(Span<const float> positions) {
        return dibs_writer_push(*this, positions.data(), uint32_t(positions.size() / 3));
    }
    Code publish(dibs_tree *tree, uint32_t epoch, uint32_t received, float error = 0.0f) {
        return dibs_writer_publish(*this, tree, epoch, received, error);
    }
};
/** The bus's end of a surface. */
struct Receiver : Object<dibs_receiver, DIBS_RECEIVER_SIZE, dibs_receiver_init> {
    Code init(dibs_surface *surface, dibs_tree *tree, const dibs_surface_limits *limits) {
        return Object::init(surface, tree, limits);
    }
    /** Of packets with tags alone. */
    Code init(dibs_surface *surface, dibs_tree *tree, const dibs_surface_limits *limits, dibs_tags *tags) {
        return init_by<dibs_receiver_init_with_tags>(surface, tree, limits, tags);
    }
    Code accept(Span<const uint8_t> packet, uint32_t now, dibs_progress *progress = nullptr) {
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
