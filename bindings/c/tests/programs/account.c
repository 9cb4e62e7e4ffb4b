/*
 * A hand at a wall that jumps. tests/account.rs compares each line with the Rust library's.
 *
 *     account FORCES
 *
 * FORCES  lines: the wall's force and the relative velocity, three numbers each
 */
#include "expect.h"

#include <string.h>

MEMORY(memory, DIBS_ACCOUNT_SIZE);

static void misuse(void) {
    static alignas(DIBS_ALIGNMENT) unsigned char other[DIBS_ACCOUNT_SIZE];
    const dibs_vec3 zero = {0.0f, 0.0f, 0.0f};
    dibs_vec3 applied;
    float balance;
    dibs_account *account = (dibs_account *)(void *)other;
    EXPECT(NOT_INITIALISED, dibs_account_pass(account, zero, zero, 0.001f, &applied));
    EXPECT(NOT_INITIALISED, dibs_account_balance(account, &balance));
    EXPECT(GAIN, dibs_account_init(other, sizeof other, 0.0f, 0.5f, 1.0f, 5.0f, 300.0f, &account));
    EXPECT(GAIN, dibs_account_init(other, sizeof other, 1.0f, -0.5f, 1.0f, 5.0f, 300.0f, &account));
    EXPECT(GAIN, dibs_account_init(other, sizeof other, 1.0f, 0.5f, 1.0f, 5.0f, -300.0f, &account));
    EXPECT(STORAGE_SIZE, dibs_account_init(other, sizeof other - 1, 1.0f, 0.5f, 1.0f, 5.0f, 300.0f, &account));
    EXPECT(STORAGE_ALIGNMENT, dibs_account_init(other + 4, sizeof other, 1.0f, 0.5f, 1.0f, 5.0f, 300.0f, &account));
    EXPECT(NULL, dibs_account_init(other, sizeof other, 1.0f, 0.5f, 1.0f, 5.0f, 300.0f, NULL));
    EXPECT(OK, dibs_account_init(other, sizeof other, 1.0f, 0.5f, 1.0f, 5.0f, 300.0f, &account));
    EXPECT(NULL, dibs_account_pass(account, zero, zero, 0.001f, NULL));
    EXPECT(NULL, dibs_account_pass(NULL, zero, zero, 0.001f, &applied));
    EXPECT(NULL, dibs_account_balance(account, NULL));
}

int main(int argc, char **argv) {
    static char line[1 << 10];
    dibs_account *account;
    FILE *forces = argc == 2 ? fopen(argv[1], "r") : NULL;
    if (forces == NULL) {
        return 2;
    }
    misuse();
    EXPECT(OK, dibs_account_init(memory, sizeof memory, 1.0f, 0.5f, 1.0f, 5.0f, 300.0f, &account));
    while (fgets(line, sizeof line, forces) != NULL) {
        char *rest = line;
        float numbers[6];
        float words[4];
        uint32_t bits[4];
        for (size_t at = 0; at < 6; at++) {
            numbers[at] = strtof(rest, &rest);
        }
        dibs_vec3 force = {numbers[0], numbers[1], numbers[2]};
        const dibs_vec3 velocity = {numbers[3], numbers[4], numbers[5]};
        EXPECT(OK, dibs_account_pass(account, force, velocity, 0.001f, &force));
        EXPECT(OK, dibs_account_balance(account, &words[3]));
        memcpy(words, &force, sizeof force);
        memcpy(bits, words, sizeof bits);
        printf("%08x %08x %08x %08x\n", bits[0], bits[1], bits[2], bits[3]);
    }
    return summary();
}
