/*
 * The control tick of a robot that keeps its instrument off a moving surface, as ros2_control calls it. README.md has
 * the lines around it; alone.cpp calls it without ROS.
 *
 * `configure` is for on_configure, `receive` for a thread of its own, `update` for the real-time thread: it allocates
 * nothing, takes no lock and throws nothing. One thread each.
 */
#pragma once
#include <dibs.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <vector>

class WallController {
public:
    /** `tree` are the bytes of `dibs build`; `vertices` is the number that `dibs inspect` prints. */
    dibs::Code configure(std::span<const std::uint8_t> tree, std::uint32_t vertices, const dibs_guard_limits &limits,
                         const dibs_wall &of_wall) {
        /* Until it succeeds, packets and ticks return an error, and the force is the hold. */
        bus = nullptr;
        guard = nullptr;
        bytes.assign(tree.begin(), tree.end());
        const std::size_t size = DIBS_START_SIZE(std::size_t{vertices});
        memory.reset(new (std::align_val_t{DIBS_ALIGNMENT}) std::uint8_t[size]);
        wall = of_wall;
        return dibs_start(memory.get(), size, bytes.data(), bytes.size(), &limits, &bus, &guard);
    }

    /** Receives a datagram of `dibs stream` or surface_node.py, at a time in ms. Returns the status to send, if any. */
    std::span<const std::uint8_t> receive(std::span<const std::uint8_t> packet, std::uint32_t now) {
        /* Errors of packets and frames are counted, and the latest published surface stays. */
        dibs_bus_packet(bus, packet.data(), packet.size(), now, nullptr);
        dibs_advance advance = DIBS_ADVANCE_PENDING;
        while (dibs_bus_work(bus, 1000, &advance) == DIBS_CODE_OK && advance == DIBS_ADVANCE_PENDING) {}
        std::size_t length = 0;
        dibs_bus_status(bus, now, 0, status.data(), status.size(), &length);
        return std::span(status).first(length);
    }

    /** The tool of this tick, and the force on it. After any error the force is the hold. */
    dibs::Code update(const dibs_tool &tool, std::uint32_t now, dibs_force &force) {
        force = {};
        force.state = DIBS_FORCE_STATE_SAFE;
        const dibs::Code code = dibs_guard_closest(guard, &tool, now, &answer);
        return code == DIBS_CODE_OK ? dibs_answer_force(&answer, &wall, &force) : code;
    }

    /** The last tick's answer, for records: the pair, its interval, the trust in the surface. */
    const dibs_answer &last() const { return answer; }

    /** Whether only an acknowledgement is missing to leave the safe state. */
    bool waits() const { return answer.trust.waits_for_acknowledgement != 0; }

    /** An operator's acknowledgement: call it between two ticks, in the same thread. */
    dibs::Code acknowledge() { return dibs_guard_acknowledge(guard); }

private:
    struct Free {
        void operator()(std::uint8_t *at) const { ::operator delete[](at, std::align_val_t{DIBS_ALIGNMENT}); }
    };
    std::vector<std::uint8_t> bytes;
    std::unique_ptr<std::uint8_t[], Free> memory;
    std::array<std::uint8_t, DIBS_STATUS> status{};
    dibs_wall wall{};
    dibs_answer answer{};
    dibs_bus *bus = nullptr;
    dibs_guard *guard = nullptr;
};
