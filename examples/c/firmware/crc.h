/* The checksum of telemetry and of the published surface: CRC-32 (ISO-HDLC). */
#ifndef CRC_H
#define CRC_H

#include <stddef.h>
#include <stdint.h>

/* The value before the first byte. */
#define CRC_START UINT32_MAX

/* Adds bytes. */
uint32_t crc_take(uint32_t crc, const void *bytes, size_t length);

/* The checksum after the last byte. */
uint32_t crc_end(uint32_t crc);

#endif
