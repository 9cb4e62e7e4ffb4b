/* Tests dibs.hpp: a query, a frame held and released by scope, and codes instead of exceptions. Run by
* tests/wrapper.rs. */
#include <dibs.hpp>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <vector>

namespace {

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
    if (argc != 3) {
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
    dibs_proximity on_bus, at_rest;

    EXPECT(DIBS_CODE_NULL, query.init(tree));
    MUST(tree.init(bytes));
    MUST(query.init(tree));
    MUST(contacts.init());
    MUST(surface.init());
    MUST(receiver.init(surface, tree, {300.0f, std::numeric_limits<float>::infinity(), 0.25f}));
    MUST(reader.init(surface));
    EXPECT(DIBS_CODE_TAKEN, dibs::Reader().init(surface));

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

    std::array<dibs_row, DIBS_CONTACTS> room;
    std::span<dibs_row> rows;
    MUST(query.contacts(frame, tool, 60.0f, contacts));
    MUST(contacts.rows(tool.start, 1.0f, 20.0f, room, rows));
    EXPECT(true, !rows.empty());
    std::printf("%a mm, %zu rows\n", static_cast<double>(at_rest.separation), rows.size());
    return EXIT_SUCCESS;
}
