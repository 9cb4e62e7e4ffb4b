/*
 * Runs WallController without ROS: 1,000 ticks a second of simulated time, a tool that approaches the surface, and a stream
 * that stops. bindings/c/tests/ros2.rs runs it.
 *
 *     alone TREE PACKETS
 *
 * PACKETS  frames, one 33 ms after the other: each is the number of its packets, and each packet its length and its bytes;
 *          numbers are little-endian u32
 */
#include "wall_controller.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

namespace {

std::vector<std::uint8_t> read(const char *path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void must(dibs_code code) {
    if (code != DIBS_CODE_OK) {
        std::printf("%s\n", dibs_code_text(code));
        std::exit(EXIT_FAILURE);
    }
}

std::uint32_t number(const std::uint8_t *&from) {
    std::uint32_t number = 0;
    std::memcpy(&number, from, sizeof number);
    from += sizeof number;
    return number;
}

} // namespace

int main(int argc, char **argv) {
    if (argc != 3) {
        return EXIT_FAILURE;
    }
    const auto tree = read(argv[1]), stream = read(argv[2]);
    dibs_guard_limits limits = dibs_guard_limits_of(300.0f, 80);
    limits.without_transit = 1;
    dibs_wall wall{};
    wall.stiffness = 1.0f;
    wall.damping = 0.002f;
    wall.hold_damping = 0.001f;
    wall.max_force = 5.0f;
    wall.margin = 5.0f;
    WallController controller;
    must(controller.configure(tree, limits, wall));

    const std::uint8_t *rest = stream.data(), *const end = rest + stream.size();
    std::uint32_t states[4] = {}, statuses = 0;
    float largest = 0.0f;
    for (std::uint32_t now = 1000; now < 5000; now++) {
        if (now % 33 == 0 && rest != end) {
            for (std::uint32_t packets = number(rest); packets > 0; packets--) {
                const std::uint32_t length = number(rest);
                statuses += controller.receive({rest, length}, now).size() > 0;
                rest += length;
            }
        }
        const float x = 52.0f + (now < 4000 ? 0.05f * static_cast<float>(4000 - now) : 0.0f); /* mm: 50 mm/s */
        const dibs_tool tool = {{x, 0.0f, 20.0f}, {x + 70.0f, 0.0f, 50.0f}, 2.5f};
        dibs_force force;
        must(controller.update(tool, now, force));
        states[force.state]++;
        const float size = force.force.x * force.force.x + force.force.y * force.force.y + force.force.z * force.force.z;
        largest = size > largest ? size : largest;
        if (controller.waits()) {
            must(controller.acknowledge());
        }
    }
    std::printf("%u ticks without a force, %u at the wall, %u with its largest force, %u held; %u statuses; at most %.2f N\n", states[0],
                states[1], states[2], states[3], statuses, static_cast<double>(std::sqrt(largest)));
}
