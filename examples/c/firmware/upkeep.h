/* The background's check of the tree in flash. */
#ifndef UPKEEP_H
#define UPKEEP_H

#include <stdbool.h>
#include <stdint.h>

/* Makes the check. */
void upkeep_init(void);

/* Checks one slice. */
void upkeep_step(void);

/* Rounds finished. */
uint32_t upkeep_rounds(void);

/* Whether the tree was ever found changed: flash that read wrong once is not trusted. From any context. */
bool upkeep_is_tree_corrupt(void);

#endif
