/* Tests dibs.hpp: queries, scenes, trackers and sweeps, nodes, an account, a frame held and released by
 * scope, and codes instead of exceptions. Run by tests/wrapper.rs. */
#include <dibs.hpp>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <type_traits>
#include <vector>

namespace {

/* The library keeps the addresses of objects. */
template <class T> constexpr bool stays = !std::is_copy_constructible_v<T> && !std::is_move_constructible_v<T> &&
                                          !std::is_copy_assignable_v<T> && !std::is_move_assignable_v<T>;
static_assert(stays<dibs::Sender> && stays<dibs::Tree> && stays<dibs::Frame> && stays<dibs::Surface<502>> && stays<dibs::Tracker<502>>);

std::vector<std::uint8_t> read(const char *path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void must(dibs_code code, int line) {
    if (code != DIBS_CODE_OK) {
        const auto text = dibs::text(code);
        std::printf("line %d: %.*s\n", line, static_cast<int>(text.size()), text.data());
        std::exit(EXIT_FAILURE);
    }
}

#define MUST(call) must(call, __LINE__)
#define EXPECT(code, call) must((call) == (code) ? DIBS_CODE_OK : DIBS_CODE_ARGUMENT, __LINE__)

} // namespace

int main(int argc, char **argv) {
    if (argc != 5) {
        return EXIT_FAILURE;
    }
    const auto bytes = read(argv[1]);
    const auto packets = read(argv[2]);
    const dibs_tool tool = {{100.0f, 0.0f, 20.0f}, {140.0f, 0.0f, 50.0f}, 2.5f};
    static dibs::Tree tree;
    static dibs::Query query;
    static dibs::Contacts contacts;
    static dibs::Surface<502> surface;
    static dibs::Receiver receiver;
    static dibs::Reader reader;
    static dibs::Query other_query;
    static dibs::Tracker<502> trackers[2];
    static dibs::FailSafe failsafe;
    const dibs_surface_limits surface_limits = {300.0f, std::numeric_limits<float>::infinity(), 0.25f, 0.0f};
    dibs_proximity on_bus, at_rest;

    EXPECT(DIBS_CODE_NULL, query.init(tree));
    MUST(tree.init(bytes));
    /* After an `init` that fails there is no object. */
    EXPECT(DIBS_CODE_NULL, tree.init({}));
    EXPECT(DIBS_CODE_NOT_INITIALISED, query.init(tree));
    MUST(tree.init(bytes));
    MUST(query.init(tree));
    MUST(contacts.init());
    MUST(surface.init());
    MUST(receiver.init(surface, tree, &surface_limits));
    MUST(reader.init(surface));
    EXPECT(DIBS_CODE_TAKEN, dibs::Reader().init(surface));

    {
        dibs::Sender sender;
        EXPECT(DIBS_CODE_SENDER_TARGET, sender.init(tree, "udp:"));
        MUST(sender.init(tree, "udp:127.0.0.1:9"));
        std::array<float, 3> few{};
        EXPECT(DIBS_CODE_SENDER_FRAME, sender.send(few));
        EXPECT(DIBS_CODE_SENDER_FRAME, sender.send_at(few, {{0.0f, 0.0f, 0.0f, 1.0f}, {}}, 0));
        EXPECT(DIBS_CODE_ARGUMENT, sender.send_at(few, {{0.0f, 0.0f, 0.0f, 1.0f}, {}}, DIBS_AGE_UNKNOWN));
        MUST(sender.poll());
    }
    {
        /* With tags the packets, which have none, are forgeries to bus, loop and receiver; a sender waits. */
        constexpr std::uint8_t key[DIBS_KEY] = {1, 2, 3};
        static dibs::Tags tags;
        static dibs::GuardedSurface<502> tagged_surface;
        static dibs::Bus tagged;
        static dibs::Surface<502> of_receiver;
        static dibs::Receiver tagged_receiver;
        const dibs_guard_limits limits = dibs_guard_limits_of(300.0f, 80);
        dibs::Loop loop;
        dibs::Sender sender;
        EXPECT(DIBS_CODE_NULL, loop.init(bytes, limits, tags));
        MUST(tags.init(key, 7, 0x5EED));
        MUST(loop.init(bytes, limits, tags));
        MUST(tagged_surface.init());
        MUST(of_receiver.init());
        MUST(tagged.init(tagged_surface, tree, &limits, tags));
        MUST(tagged_receiver.init(of_receiver, tree, &surface_limits, tags));
        MUST(tagged.receive(packets, 0));
        MUST(loop.bus.receive(packets, 0));
        std::uint32_t counts[3][DIBS_EVENTS];
        dibs_code last = DIBS_CODE_OK;
        for (const auto byte : packets) {
            const auto code = dibs_receiver_byte(tagged_receiver, byte, 0, nullptr);
            last = code == DIBS_CODE_OK ? last : code;
        }
        EXPECT(DIBS_CODE_PACKET_FORGED, last);
        MUST(dibs_bus_counters(tagged, counts[0]));
        MUST(dibs_bus_counters(loop.bus, counts[1]));
        MUST(dibs_receiver_counters(tagged_receiver, counts[2]));
        for (std::uint32_t event = 0; event < DIBS_EVENTS; event++) {
            const bool is_forged = dibs_event_name(event) == std::string_view("forged");
            for (const auto &count : counts) {
                EXPECT(true, (count[event] > 0) == is_forged);
            }
        }
        MUST(sender.init(tree, "udp:127.0.0.1:9", key, 7));
        EXPECT(DIBS_CODE_SENDER_NO_CHALLENGE, sender.send(std::vector<float>(3 * 502)));
        MUST(sender.challenge(0x5EED));
        EXPECT(DIBS_CODE_SENDER_FRAME, sender.send(std::vector<float>(3)));
    }
    for (std::size_t at = 0; at < packets.size(); at++) {
        MUST(dibs_receiver_byte(receiver, packets[at], 0, nullptr));
        MUST(receiver.advance(10'000));
    }
    {
        dibs::Frame frame, other;
        MUST(frame.init());
        MUST(other.init());
        MUST(reader.latest(1, 50, frame));
        EXPECT(DIBS_CODE_HELD, reader.latest(1, 50, other));
        MUST(query.closest(frame, tool, on_bus));

        /* A tracker on the bus' frame itself, in storage without room for a copy. */
        static dibs::Tracker<0> tracker;
        dibs_tracked tracked;
        MUST(tracker.init(tree));
        EXPECT(DIBS_CODE_VERTEX_COUNT, tracker.set(frame));
        MUST(tracker.closest_on(frame, tool, tracked));
        EXPECT(true, tracked.moved == -1.0f);
        EXPECT(true, tracked.fallback == DIBS_FALLBACK_START && tracked.proximity.separation == on_bus.separation);
        MUST(tracker.closest_on(frame, tool, tracked));
        EXPECT(true, tracked.moved == 0.0f);
        EXPECT(true, tracked.fallback == DIBS_FALLBACK_NONE && tracked.proximity.separation == on_bus.separation);
        EXPECT(true, tracked.proximity.node_tests < on_bus.node_tests);
        EXPECT(true, tracked.proximity.coverage == DIBS_COVERAGE_MEASURED);

        /* Commands towards the surface, filtered on the bus' frame itself. */
        const dibs::Filter filter(1.0f, 1000.0f);
        const dibs_uncertainty still = {0.0f, 0.0f};
        dibs_tracker *one[] = {tracker};
        dibs_tool at = tool;
        dibs_admitted_motion admitted;
        for (int tick = 0; tick < 200; tick++) {
            const dibs_rigid_motion command = {at.start, {-0.5f, 0.0f, 0.0f}, {}};
            MUST(filter.admit(one, dibs::Tools(&at, 1), command, 0.001f, still, admitted, {}, frame));
            EXPECT(true, admitted.least_separation > 0.98f && admitted.reason != DIBS_REASON_NO_SAFE_MOTION);
            MUST(dibs_rigid_motion_apply(&admitted.motion, &at, &at));
        }
        EXPECT(true, admitted.reason != DIBS_REASON_COMMANDED && at.start.x < 99.0f);
        MUST(query.closest(frame, at, on_bus));
        EXPECT(true, on_bus.separation > 0.98f && on_bus.separation < 1.1f);
        MUST(query.closest(frame, tool, on_bus));
        EXPECT(DIBS_CODE_ARGUMENT, filter.admit(one, {}, {}, 0.001f, still, admitted));
        EXPECT(DIBS_CODE_NO_SURFACE, filter.admit(one, dibs::Tools(&at, 1), {}, 0.001f, still, admitted));
    }
    dibs::Frame frame;
    MUST(frame.init());
    /* The end of the scope released the surface. */
    MUST(reader.latest(1, 50, frame));

    dibs_tree_facts facts;
    MUST(dibs_tree_get_facts(tree, &facts));
    std::vector<float> positions;
    for (std::uint32_t row = 0; row < facts.vertices; row++) {
        dibs_vec3 at;
        MUST(dibs_tree_rest_position(tree, row, &at));
        positions.insert(positions.end(), {at.x, at.y, at.z});
    }
    MUST(frame.set(positions));
    MUST(query.closest(frame, tool, at_rest));
    EXPECT(true, on_bus.separation == at_rest.separation && at_rest.separation > 0.0f);

    /* A corner's number in the mesh's file is the one whose position its row takes. */
    std::vector<float> numbers, numbered(positions.size());
    for (std::uint32_t number = 0; number < facts.file_vertices; number++) {
        numbers.insert(numbers.end(), {static_cast<float>(number), 0.0f, 0.0f});
    }
    dibs::Span<float> by_row;
    std::uint32_t number;
    MUST(tree.to_rows(numbers, numbered, by_row));
    for (const auto row : at_rest.corners) {
        MUST(tree.vertex_number(row, number));
        EXPECT(true, by_row[3 * row] == static_cast<float>(number));
    }
    EXPECT(DIBS_CODE_ARGUMENT, tree.vertex_number(facts.vertices, number));

    /* The same heart, carried by nodes: the intervals of both answers have the true separation. */
    const auto bytes_of_nodes = read(argv[3]);
    const auto file = read(argv[4]);
    const dibs::Span<const float> nodes(reinterpret_cast<const float *>(file.data()), file.size() / sizeof(float));
    static dibs::Tree of_nodes;
    static dibs::Query on_nodes;
    dibs::Frame carried;
    dibs_frame_facts of_frame;
    dibs_proximity by_nodes;
    dibs_interval one, other;
    MUST(of_nodes.init(bytes_of_nodes));
    MUST(on_nodes.init(of_nodes));
    MUST(carried.init());
    EXPECT(DIBS_CODE_VERTEX_COUNT, carried.set_nodes(of_nodes, {nodes.data(), nodes.size() - 3}));
    MUST(carried.set_nodes(of_nodes, nodes, 0.25f));
    MUST(dibs_frame_get_facts(carried, &of_frame));
    EXPECT(true, of_frame.vertices == facts.vertices && of_frame.position_error >= 0.25f);
    MUST(carried.set_nodes(of_nodes, nodes));
    MUST(carried.measure(of_nodes));
    MUST(on_nodes.closest(carried, tool, by_nodes));
    MUST(dibs_proximity_interval(&at_rest, &one));
    MUST(dibs_proximity_interval(&by_nodes, &other));
    EXPECT(true, one.lower <= other.upper && other.lower <= one.upper);

    std::array<dibs_row, DIBS_CONTACTS> room;
    dibs::Span<dibs_row> rows;
    MUST(query.contacts(frame, tool, 60.0f, contacts));
    MUST(contacts.rows(tool.start, 1.0f, 20.0f, room, rows));
    EXPECT(true, rows.size() > 0);

    /* A chain of two tools, and a second surface beside the first. */
    const dibs_tool chain[] = {tool, {tool.start, {100.0f, -40.0f, 20.0f}, 2.5f}};
    auto moved = positions;
    for (std::size_t x = 0; x < moved.size(); x += 3) {
        moved[x] += 250.0f;
    }
    dibs::Frame beside;
    MUST(beside.init());
    MUST(beside.set(moved));
    MUST(other_query.init(tree));
    dibs_query *queries[] = {query, other_query};
    dibs_frame *frames[] = {frame, beside};
    const dibs::Scene scene(queries, frames, chain);
    dibs_closest of_scene;
    MUST(scene.closest(of_scene));
    EXPECT(true, of_scene.proximity.separation <= at_rest.separation);
    MUST(scene.contacts(60.0f, contacts));
    MUST(contacts.rows(tool.start, 1.0f, 20.0f, room, rows));
    EXPECT(true, rows.size() > 0);
    EXPECT(DIBS_CODE_ARGUMENT, dibs::Scene(queries, dibs::Span<dibs_frame *const>(frames, 1), chain).closest(of_scene));
    EXPECT(DIBS_CODE_ARGUMENT, dibs::Scene(queries, frames, {}).closest(of_scene));

    /* The same by trackers, on the first surface. */
    dibs_tracked tracked, of_chain;
    for (auto &tracker : trackers) {
        MUST(tracker.init(tree));
        MUST(tracker.set(frame));
        MUST(tracker.closest(tool, tracked));
        EXPECT(true, tracked.proximity.separation == at_rest.separation && tracked.is_kept == 0);
    }
    MUST(trackers[0].contacts(tool, 60.0f, contacts));
    dibs_tracker *both[] = {trackers[0], trackers[1]};
    MUST(dibs::closest_of(both, chain, of_chain));
    EXPECT(true, of_chain.proximity.separation <= at_rest.separation);
    EXPECT(DIBS_CODE_ARGUMENT, dibs::closest_of(both, dibs::Tools(chain, 1), of_chain));

    /* Between two ticks the tool goes through the surface, or stays. */
    const dibs_tool within = {{0.0f, 0.0f, 20.0f}, {40.0f, 0.0f, 50.0f}, 2.5f};
    dibs_swept swept;
    MUST(trackers[0].sweep({tool, within, {1.0f, 1.0f}, 0.0f, 24}, swept));
    EXPECT(true, swept.contact > 0.0f && swept.contact < 1.0f && swept.clear_until <= swept.contact);
    MUST(trackers[0].sweep({tool, tool, {1.0f, 1.0f}, 0.0f, 24}, swept));
    EXPECT(true, swept.contact == -1.0f && swept.clear_until >= 1.0f && swept.at_end.separation == at_rest.separation);
    EXPECT(DIBS_CODE_MARGIN, trackers[0].sweep({tool, tool, {1.0f, 1.0f}, -1.0f, 24}, swept));

    /* The force rises in steps, and what it gives leaves the tank. */
    static dibs::Account account;
    dibs_vec3 applied;
    float full, balance;
    EXPECT(DIBS_CODE_NULL, account.balance(full));
    EXPECT(DIBS_CODE_GAIN, account.init(0.0f, 0.5f, 1.0f, 5.0f, 300.0f));
    MUST(account.init(1.0f, 0.5f, 1.0f, 5.0f, 300.0f));
    MUST(account.balance(full));
    MUST(account.pass({3.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, 0.001f, applied));
    EXPECT(true, applied.x > 0.49f && applied.x <= 0.5f);
    MUST(account.pass({3.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, 0.001f, applied));
    MUST(account.balance(balance));
    EXPECT(true, applied.x > 0.98f && applied.x <= 1.0f && full == 1.0f && balance < full);

    /* The loop: the same frames, and an answer on the last of them. */
    static dibs::GuardedSurface<502> guarded;
    static dibs::Bus bus;
    static dibs::Guard guard;
    static dibs::Writer writer;
    const dibs_guard_limits guard_limits = dibs_guard_limits_of(300.0f, 80);
    dibs_answer answer;
    EXPECT(DIBS_CODE_STORAGE_SIZE, bus.init(surface, tree, &guard_limits));
    MUST(guarded.init());
    MUST(bus.init(guarded, tree, &guard_limits));
    MUST(guard.init(guarded, tree, &guard_limits));
    EXPECT(DIBS_CODE_TAKEN, writer.init(guarded));
    for (std::size_t at = 0; at < packets.size(); at++) {
        MUST(bus.receive(dibs::Span<const std::uint8_t>(&packets[at], 1), 0));
        MUST(bus.work(10'000));
    }
    EXPECT(DIBS_CODE_PACKET_DAMAGED, bus.packet(dibs::Span<const std::uint8_t>(packets.data(), 8), 0));
    MUST(guard.closest(tool, 1, answer));
    EXPECT(true, answer.age.is_published == 1 && answer.age.epoch == 2);
    EXPECT(true, answer.searched.outcome == DIBS_CODE_OK && answer.searched.tracked.opened > 0);
    dibs_bus_facts of_bus;
    dibs_vec3 at;
    MUST(dibs_bus_get_facts(bus, &of_bus));
    EXPECT(true, of_bus.is_published == 1 && of_bus.epoch == 2);
    MUST(dibs_bus_position(bus, 501, &at));
    EXPECT(true, at.x == positions[3 * 501]);
    EXPECT(DIBS_CODE_ARGUMENT, dibs_bus_position(bus, 502, &at));
    EXPECT(true, answer.trust.state == DIBS_STATE_SAFE && answer.outcome != DIBS_CODE_OK);
    dibs_admitted_motion admitted;
    const auto cause = guard.admit(dibs::Filter(1.0f, 200.0f), tool, {tool.start, {}, {}}, 2, admitted, &answer);
    EXPECT(true, cause != DIBS_CODE_OK && cause == answer.trust.cause && answer.age.epoch == 2);
    EXPECT(DIBS_CODE_ACKNOWLEDGE, guard.acknowledge());

    /* The same loop in memory that the wrapper takes for as many vertices as the tree has. */
    dibs::Loop loop;
    EXPECT(DIBS_CODE_NULL, loop.guard.closest(tool, 1, answer));
    EXPECT(DIBS_CODE_TREE_LENGTH, loop.init({bytes.data(), 8}, guard_limits));
    MUST(loop.init(bytes, guard_limits));
    MUST(loop.init(bytes, guard_limits));
    MUST(loop.bus.receive(packets, 0));
    MUST(loop.bus.work(100'000));
    const float weight = 0.0f;
    EXPECT(DIBS_CODE_TREE_NO_MODES, loop.bus.weights(tree, {&weight, 1}, nullptr, 1, 1));
    dibs_answer of_loop;
    MUST(loop.guard.closest(tool, 1, of_loop));
    EXPECT(true, of_loop.age.is_published == 1 && of_loop.searched.tracked.proximity.separation == answer.searched.tracked.proximity.separation);
    EXPECT(DIBS_CODE_LIMIT_SPEED, loop.init(bytes, dibs_guard_limits_of(-1.0f, 80)));
    EXPECT(DIBS_CODE_NULL, loop.guard.closest(tool, 1, answer));

    /* Positions of the caller's, published. */
    static dibs::Surface<502> written;
    MUST(written.init());
    MUST(writer.init(written));
    MUST(writer.begin());
    MUST(writer.push(positions));
    MUST(writer.publish(tree, 1, 0));
    static dibs::Reader of_writer;
    MUST(of_writer.init(written));
    MUST(of_writer.latest(1, 50, frame));
    MUST(query.closest(frame, tool, at_rest));
    EXPECT(true, on_bus.separation == at_rest.separation && at_rest.coverage == DIBS_COVERAGE_MEASURED);

    const dibs_watch off = {DIBS_UNLIMITED, DIBS_UNLIMITED};
    const dibs_limits limits = {{20, 60}, off, off, off, off, off, off, 0.1f, 1, 0, 0, 0};
    dibs_verdict verdict;
    MUST(failsafe.init(&limits));
    MUST(failsafe.step({}, verdict));
    EXPECT(true, verdict.cause == DIBS_CODE_NO_SURFACE);
    std::printf("%a mm, %zu rows\n", static_cast<double>(at_rest.separation), rows.size());
    return EXIT_SUCCESS;
}
