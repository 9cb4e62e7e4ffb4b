/*
 * Packets with tags: from C's sender to a bus in C over UDP, and by files from and to the library in Rust.
 * tests/tags.rs says what must be printed.
 *
 *     tags receive TREE PACKETS           a bus takes packets, each after the numbers of its bytes and its time
 *     tags send TREE FRAME RECORDING      a sender's packets, to a bus in C, and written to a file
 */
#include "expect.h"

#include <arpa/inet.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define VERTICES 162
#define RECEIVER 7
#define CHALLENGE 0x89ABCDEF00C0FFEE

MEMORY(memory, DIBS_START_SIZE(VERTICES));
MEMORY(tags_memory, DIBS_TAGS_SIZE);
MEMORY(tree_memory, DIBS_TREE_SIZE);
MEMORY(sender_memory, DIBS_SENDER_SIZE);
MEMORY(receiver_memory, DIBS_RECEIVER_SIZE);
MEMORY(surface_memory, DIBS_SURFACE_SIZE(VERTICES));

static const uint8_t key[DIBS_KEY] = "a secret of ours", guess[DIBS_KEY] = "another's guess.";
static dibs_bus *bus;
static dibs_guard *guard;
static dibs_tags *tags;

static uint32_t count_of(const char *event) {
    uint32_t counters[DIBS_EVENTS];
    EXPECT(OK, dibs_bus_counters(bus, counters));
    for (uint32_t at = 0; at < DIBS_EVENTS; at++) {
        if (strcmp(dibs_event_name(at), event) == 0) {
            return counters[at];
        }
    }
    EXPECT_THAT(!"no such event");
    return 0;
}

static uint32_t epoch_of_bus(void) {
    dibs_bus_facts facts;
    EXPECT(OK, dibs_bus_get_facts(bus, &facts));
    return facts.epoch;
}

/* A bus and a guard that demand tags. Wrong uses are refused first. */
static void start(const unsigned char *tree, size_t length) {
    const dibs_guard_limits limits = dibs_guard_limits_of(100000.0f, 1000);
    EXPECT(NULL, dibs_tags_init(tags_memory, sizeof tags_memory, NULL, RECEIVER, CHALLENGE, &tags));
    EXPECT(STORAGE_SIZE, dibs_tags_init(tags_memory, 16, key, RECEIVER, CHALLENGE, &tags));
    EXPECT(NULL, dibs_start_with_tags(memory, sizeof memory, tree, length, &limits, NULL, &bus, &guard));
    EXPECT(NOT_INITIALISED, dibs_start_with_tags(memory, sizeof memory, tree, length, &limits, (dibs_tags *)(void *)tags_memory, &bus, &guard));
    EXPECT(OK, dibs_tags_init(tags_memory, sizeof tags_memory, key, RECEIVER, CHALLENGE, &tags));
    EXPECT(OK, dibs_start_with_tags(memory, sizeof memory, tree, length, &limits, tags, &bus, &guard));
}

/* Each packet's outcome and the latest published frame after it, then the counts; the same by a receiver. */
static void receive(const unsigned char *tree, size_t length, const unsigned char *packets, size_t left) {
    dibs_tree *own;
    dibs_surface *surface;
    dibs_receiver *receiver;
    const dibs_surface_limits limits = {1000.0f, 1000.0f, 0.0f, 0.0f};
    start(tree, length);
    EXPECT(OK, dibs_tree_init(tree_memory, sizeof tree_memory, tree, length, &own));
    EXPECT(OK, dibs_surface_init(surface_memory, sizeof surface_memory, VERTICES, &surface));
    EXPECT(OK, dibs_receiver_init_with_tags(receiver_memory, sizeof receiver_memory, surface, own, &limits, tags, &receiver));
    while (left > 0) {
        uint32_t words[2], epoch = 0;
        memcpy(words, packets, sizeof words);
        const unsigned char *packet = packets + sizeof words;
        const dibs_code code = dibs_bus_packet(bus, packet, words[0], words[1], NULL);
        EXPECT(OK, dibs_bus_work(bus, 10000, NULL));
        printf("%u %u\n", code, epoch_of_bus());
        /* `==`, not `EXPECT`: the bus's own code, whichever it is. */
        EXPECT_THAT(dibs_receiver_accept(receiver, packet, words[0], words[1], NULL) == code);
        EXPECT(OK, dibs_receiver_advance(receiver, 10000, NULL));
        (void)dibs_receiver_epoch(receiver, &epoch);
        EXPECT_THAT(epoch == epoch_of_bus());
        packets = packet + words[0];
        left -= sizeof words + words[0];
    }
    uint8_t status[DIBS_STATUS];
    size_t size;
    EXPECT(OK, dibs_bus_status(bus, 10000, 0, status, sizeof status, &size));
    printf("status ");
    for (size_t at = 0; at < size; at++) {
        printf("%02x", status[at]);
    }
    printf("\nforged %u, stale %u\n", count_of("forged"), count_of("stale"));
}

/* Gives the bus what has come, writes it to the file, and sends the statuses back. */
static void pass(int line, FILE *recording, uint32_t now) {
    struct sockaddr_in peer;
    uint8_t packet[2048], status[DIBS_STATUS];
    struct pollfd waiting = {.fd = line, .events = POLLIN};
    size_t size;
    while (poll(&waiting, 1, 20) > 0) {
        socklen_t length = sizeof peer;
        const ssize_t got = recvfrom(line, packet, sizeof packet, 0, (struct sockaddr *)&peer, &length);
        const uint32_t words[2] = {(uint32_t)got, now};
        fwrite(words, 1, sizeof words, recording);
        fwrite(packet, 1, (size_t)got, recording);
        (void)dibs_bus_packet(bus, packet, (size_t)got, now, NULL);
        EXPECT(OK, dibs_bus_work(bus, 10000, NULL));
        EXPECT(OK, dibs_bus_status(bus, now, 0, status, sizeof status, &size));
        if (size > 0) {
            sendto(line, status, size, 0, (struct sockaddr *)&peer, sizeof peer);
        }
    }
}

static void send_frames(const unsigned char *tree, size_t length, const float *positions, FILE *recording) {
    struct sockaddr_in here = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
    socklen_t size = sizeof here;
    char target[64];
    dibs_tree *own;
    dibs_sender *sender, *stranger;
    dibs_sender_facts facts = {0};
    dibs_sender_settings settings = dibs_sender_settings_of();
    const int line = socket(AF_INET, SOCK_DGRAM, 0);
    if (bind(line, (struct sockaddr *)&here, sizeof here) != 0 || getsockname(line, (struct sockaddr *)&here, &size) != 0) {
        exit(2);
    }
    snprintf(target, sizeof target, "udp:127.0.0.1:%u", ntohs(here.sin_port));
    start(tree, length);
    EXPECT(OK, dibs_tree_init(tree_memory, sizeof tree_memory, tree, length, &own));
    EXPECT(NULL, dibs_sender_init_with_key(sender_memory, sizeof sender_memory, own, target, NULL, NULL, RECEIVER, &sender));

    /* No frame before the challenge; `poll` asks for it. */
    EXPECT(OK, dibs_sender_init_with_key(sender_memory, sizeof sender_memory, own, target, &settings, key, RECEIVER, &sender));
    EXPECT(SENDER_NO_CHALLENGE, dibs_sender_send(sender, positions, VERTICES, 0, NULL));
    for (int tries = 0; tries < 500 && !facts.is_ready; tries++) {
        EXPECT(OK, dibs_sender_poll(sender));
        pass(line, recording, 1000);
        EXPECT(OK, dibs_sender_get_facts(sender, &facts, NULL));
    }
    EXPECT_THAT(facts.is_ready == 1);
    EXPECT(OK, dibs_sender_send(sender, positions, VERTICES, 0, NULL));
    for (int tries = 0; tries < 500 && !facts.is_acknowledged; tries++) {
        pass(line, recording, 1000);
        EXPECT(OK, dibs_sender_poll(sender));
        EXPECT(OK, dibs_sender_get_facts(sender, &facts, NULL));
    }
    const uint32_t published = epoch_of_bus();
    EXPECT_THAT(facts.acknowledged == published && published > 0 && count_of("forged") == 0);
    EXPECT(OK, dibs_sender_close(sender));

    /* Of a later session: another key, another receiver's number, another challenge, and no key at all. */
    settings.session++;
    settings.heartbeat = 0;
    for (int kind = 0; kind < 4; kind++) {
        const uint32_t before = count_of("forged");
        const uint8_t *other = kind == 0 ? guess : key;
        const uint32_t number = kind == 1 ? RECEIVER + 1 : RECEIVER;
        if (kind < 3) {
            EXPECT(OK, dibs_sender_init_with_key(sender_memory, sizeof sender_memory, own, target, &settings, other, number, &stranger));
            EXPECT(OK, dibs_sender_challenge(stranger, kind == 2 ? 1 : CHALLENGE));
        } else {
            EXPECT(OK, dibs_sender_init(sender_memory, sizeof sender_memory, own, target, &settings, &stranger));
            EXPECT(ARGUMENT, dibs_sender_challenge(stranger, CHALLENGE));
        }
        EXPECT(OK, dibs_sender_send(stranger, positions, VERTICES, 0, NULL));
        pass(line, recording, 1010);
        EXPECT_THAT(count_of("forged") > before && epoch_of_bus() == published);
        EXPECT(OK, dibs_sender_close(stranger));
    }
    close(line);
}

int main(int argc, char **argv) {
    size_t length, size;
    if (argc < 4) {
        return 2;
    }
    unsigned char *tree = read_file(argv[2], &length), *given = read_file(argv[3], &size);
    if (strcmp(argv[1], "receive") == 0) {
        receive(tree, length, given, size);
    } else {
        FILE *recording = fopen(argv[argc - 1], "wb");
        send_frames(tree, length, (const float *)(void *)given, recording);
        fclose(recording);
    }
    free(tree);
    free(given);
    return summary();
}
