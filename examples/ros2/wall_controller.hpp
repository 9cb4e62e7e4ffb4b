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
#include <utility>
#include <vector>

class WallController {
public:
    /** `tree` are the bytes of `dibs build`; `limits` of the tissue. Until it succeeds the force is the hold. */
    dibs::Code configure(std::vector<std::uint8_t> tree, const dibs_guard_limits &limits, const dibs_wall &of_wall) {
        bytes = std::move(tree);
        wall = of_wall;
        return loop.init(bytes, limits);
    }

    /** Receives a datagram of `dibs stream` or surface_node.py, at a time in ms. Returns the status to send, if any. */
    dibs::Span<const std::uint8_t> receive(dibs::Span<const std::uint8_t> packet, std::uint32_t now) {
        /* Errors of packets and frames are counted, and the latest published surface stays. */
        loop.bus.packet(packet, now);
        dibs_advance advance = DIBS_ADVANCE_PENDING;
        while (loop.bus.work(1000, &advance) == DIBS_CODE_OK && advance == DIBS_ADVANCE_PENDING) {}
        std::size_t length = 0;
        dibs_bus_status(loop.bus, now, 0, status.data(), status.size(), &length);
        return {status.data(), length};
    }

    /** The tool of this tick, and the force on it. After any error the force is the hold. */
    dibs::Code update(const dibs_tool &tool, std::uint32_t now, dibs_force &force) {
        force = {};
        force.state = DIBS_FORCE_STATE_SAFE;
        const dibs::Code code = loop.guard.closest(tool, now, answer);
        return code == DIBS_CODE_OK ? dibs_answer_force(&answer, &wall, &force) : code;
    }

    /** The last tick's answer, for records: the pair, its interval, the trust in the surface. */
    const dibs_answer &last() const { return answer; }

    /** Whether only an acknowledgement is missing to leave the safe state. */
    bool waits() const { return answer.trust.waits_for_acknowledgement != 0; }

    /** An operator's acknowledgement: call it between two ticks, in the same thread. */
    dibs::Code acknowledge() { return loop.guard.acknowledge(); }

private:
    std::vector<std::uint8_t> bytes;
    dibs::Loop loop;
    std::array<std::uint8_t, DIBS_STATUS> status{};
    dibs_wall wall{};
    dibs_answer answer{};
};
