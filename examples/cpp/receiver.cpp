/*
 * A controller's loop on a computer, in C++17: it receives a moving surface by UDP, and every 250 ms prints how far a tool is
 * from it, with which force a wall pushes the tool out, or why there is no answer. Enter is the operator's button, which
 * acknowledges the start; the end of the input ends the program.
 *
 *     receiver heart.dibs 5000        (or `receiver heart.dibs 5000 AGE`: surfaces of at most AGE ms; 80 suits 30 Hz)
 *     dibs stream heart.dibs --motion heart.pc2 --loop --to udp:127.0.0.1:5000
 */
#include <dibs.hpp>

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <vector>

namespace {

void must(dibs::Code code) {
    if (code != DIBS_CODE_OK) {
        std::fprintf(stderr, "%s\n", dibs_code_text(code));
        std::exit(EXIT_FAILURE);
    }
}

/** An argument that is a whole number. */
std::uint32_t number(const char *text, std::uint32_t most) {
    std::uint32_t value = 0;
    const char *end = text + std::strlen(text);
    const std::from_chars_result read = std::from_chars(text, end, value);
    if (read.ec == std::errc() && read.ptr == end && value <= most) return value;
    std::fprintf(stderr, "%s: give a whole number of at most %u\n", text, unsigned(most));
    std::exit(EXIT_FAILURE);
}

std::uint32_t milliseconds() {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    return std::uint32_t(std::chrono::duration_cast<std::chrono::milliseconds>(now).count()); // it may wrap
}

/** Takes a datagram of the sender, checks complete frames, and returns a status, whose echo measures the time on the way. */
void receive(dibs::Loop &loop, int socket, std::uint32_t now) {
    std::array<std::uint8_t, 1472> packet;
    std::array<std::uint8_t, DIBS_STATUS> status;
    sockaddr_in sender{};
    socklen_t size = sizeof sender;
    const ssize_t bytes = recvfrom(socket, packet.data(), packet.size(), 0, reinterpret_cast<sockaddr *>(&sender), &size);
    if (bytes < 0) return;
    // Errors of packets and frames are counted, and the last good surface stays.
    loop.bus.packet({packet.data(), std::size_t(bytes)}, now);
    std::size_t length = 0;
    dibs_bus_status(loop.bus, now, 0, status.data(), status.size(), &length);
    if (length > 0) sendto(socket, status.data(), length, 0, reinterpret_cast<sockaddr *>(&sender), size);
}

void print(const dibs_answer &answer, const dibs_force &force) {
    if (answer.outcome == DIBS_CODE_OK) {
        std::printf("%.3f mm, in truth at least %.3f: ", answer.closest.separation, answer.interval.lower);
    }
    if (force.state == DIBS_FORCE_STATE_SAFE) {
        // The cause of the missing answer, or why the wall cannot act on this one: its side may be unknown.
        std::printf("held: %s\n", dibs_code_text(force.cause));
    } else {
        const dibs_vec3 f = force.force;
        std::printf("%.2f N\n", std::sqrt(f.x * f.x + f.y * f.y + f.z * f.z));
    }
    std::fflush(stdout);
}

} // namespace

int main(int argc, char **argv) {
    if (argc != 3 && argc != 4) {
        std::fprintf(stderr, "receiver TREE PORT [AGE]\n");
        return EXIT_FAILURE;
    }
    std::ifstream file(argv[1], std::ios::binary);
    const std::vector<char> tree{std::istreambuf_iterator<char>(file), {}};
    // Tissue of at most 300 mm/s, surfaces of two periods at 30 Hz and the time on the way, ticks within 1,000,000 instructions.
    dibs_guard_limits limits = dibs_guard_limits_of(300.0f, argc == 4 ? number(argv[3], UINT32_MAX) : 80);
    must(dibs_budget_for_instructions(1000000, DIBS_COST_X86_CAPSULE, &limits.options.budget));
    dibs_wall wall{};
    wall.stiffness = 1.0f;  // N/mm
    wall.damping = 0.002f;  // N s/mm
    wall.max_force = 5.0f;  // N
    wall.margin = 5.0f;     // mm
    dibs::Loop loop;
    must(loop.init({reinterpret_cast<const std::uint8_t *>(tree.data()), tree.size()}, limits));

    const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_port = htons(std::uint16_t(number(argv[2], UINT16_MAX)));
    here.sin_addr.s_addr = htonl(INADDR_ANY);
    if (bind(socket, reinterpret_cast<const sockaddr *>(&here), sizeof here) != 0) {
        std::perror(argv[2]);
        return EXIT_FAILURE;
    }
    const dibs_tool tool = {{0.0f, 0.0f, 90.0f}, {0.0f, 0.0f, 150.0f}, 2.5f};
    for (std::uint32_t now = milliseconds(), printed = now;;) {
        pollfd ready[] = {{socket, POLLIN, 0}, {STDIN_FILENO, POLLIN, 0}};
        poll(ready, 2, 1);
        if (ready[0].revents != 0) receive(loop, socket, milliseconds());
        loop.bus.work(1000);
        if (ready[1].revents != 0) {
            char keys[64];
            if (read(STDIN_FILENO, keys, sizeof keys) <= 0) return EXIT_SUCCESS;
            const dibs::Code code = loop.guard.acknowledge();
            if (code != DIBS_CODE_OK) std::printf("%s\n", dibs_code_text(code));
        }
        if (milliseconds() == now) continue;
        now = milliseconds();
        dibs_answer answer;
        dibs_force force{};
        must(loop.guard.closest(tool, now, answer));
        must(dibs_answer_force(&answer, &wall, &force));
        if (now - printed < 250) continue;
        printed = now;
        print(answer, force);
    }
}
