#include "telemetry.h"

#include "crc.h"
#include "uart.h"

/* The largest record; its checksum and COBS's two bytes are added. From 254 bytes on COBS needs another byte. */
#define LARGEST (sizeof(tick_record) > sizeof(summary_record) ? sizeof(tick_record) : sizeof(summary_record))
#define FRAMED (LARGEST + sizeof(uint32_t) + 2)
_Static_assert(LARGEST + sizeof(uint32_t) < 254, "one block of COBS");

uint32_t telemetry_cause(dibs_code cause) {
    switch (cause) {
    case DIBS_CODE_OK:
        return 0;
    case DIBS_CODE_NO_SURFACE:
        return 1;
    case DIBS_CODE_STALE:
        return 2;
    case DIBS_CODE_LINK_LOST:
        return 4;
    case DIBS_CODE_HEARTBEAT_LOST:
        return 5;
    case DIBS_CODE_REJECTIONS:
        return 6;
    case DIBS_CODE_TREE_CORRUPT:
        return 7;
    case DIBS_CODE_DELAYED:
        return 9;
    case DIBS_CODE_SOURCE_STALE:
        return 10;
    case DIBS_CODE_FORGERIES:
        return 11;
    case DIBS_CODE_CUT_SHORT:
        return 12;
    case DIBS_CODE_UNACKNOWLEDGED:
        return 13;
    case DIBS_CODE_NOT_FINITE:
        return 8;
    case DIBS_CODE_NO_POSE:
        return 14;
    case DIBS_CODE_NO_DIRECTION:
        return 15;
    case DIBS_CODE_NO_SIDE:
        return 16;
    default:
        /* Any other cause: the query failed. */
        return 3;
    }
}

/* A block of COBS that is being written: each zero is replaced by the distance to the next one. */
typedef struct {
    uint8_t bytes[FRAMED];
    size_t length;
    size_t zero;
} block;

static void put(block *to, uint8_t byte) {
    if (byte != 0) {
        to->bytes[to->length] = byte;
    } else {
        to->bytes[to->zero] = (uint8_t)(to->length - to->zero);
        to->zero = to->length;
    }
    to->length++;
}

void telemetry_send(const void *record, size_t size) {
    if (size > LARGEST) {
        return;
    }
    static block line;
    line.length = 1;
    line.zero = 0;
    const uint8_t *fields = record;
    for (size_t at = 0; at < size; at++) {
        put(&line, fields[at]);
    }
    const uint32_t checksum = crc_end(crc_take(CRC_START, fields, size));
    for (uint32_t shift = 0; shift < 32; shift += 8) {
        put(&line, (uint8_t)(checksum >> shift));
    }
    /* The last distance is that to the zero that ends the frame. */
    put(&line, 0);
    line.bytes[line.length - 1] = 0;
    uart_write(UART_TELEMETRY, line.bytes, line.length);
}
