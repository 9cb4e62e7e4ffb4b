#include "instrument.h"

#include "surface.h"

/* Length and radius of the last link, in mm. */
#define LENGTH 60.0f
#define RADIUS 2.5f
/* Amplitude of the hand's tremor, in mm. */
#define TREMOR 0.1f

#define TURN 6.28318530717958647692f

/* The sine of an angle in turns, at least 0, with an error of at most 4e-6. */
static float sine(float turns) {
    /* Reduces the angle to half a turn around 0, then to a quarter, where a short series suffices. */
    turns -= (float)(uint32_t)(turns + 0.5f);
    if (turns > 0.25f) {
        turns = 0.5f - turns;
    } else if (turns < -0.25f) {
        turns = -0.5f - turns;
    }
    const float x = TURN * turns;
    const float square = x * x;
    const float inner = 1.0f - square / 42.0f * (1.0f - square / 72.0f);
    return x * (1.0f - square / 6.0f * (1.0f - square / 20.0f * inner));
}

static float wave(uint32_t tick, uint32_t period, float phase) {
    return sine((float)(tick % period) / (float)period + phase);
}

dibs_tool instrument(uint32_t tick) {
    const dibs_vec3 centre = surface_centre();
    const float reach = surface_reach();
    /* From 1.5 times the surface's size down to its middle. */
    const float distance = reach * (0.75f + 0.75f * wave(tick, 7000, 0.25f));
    const dibs_vec3 tip = {
        centre.x + wave(tick, 11000, 0.25f) * distance + TREMOR * wave(tick, 111, 0.0f),
        centre.y + wave(tick, 11000, 0.0f) * distance + TREMOR * wave(tick, 113, 0.3f),
        centre.z + 0.6f * wave(tick, 5300, 0.1f) * distance + TREMOR * wave(tick, 109, 0.7f),
    };
    const dibs_vec3 shaft = {
        centre.x + 0.3f * reach - tip.x,
        centre.y - 0.4f * reach - tip.y,
        centre.z + 2.0f * reach - tip.z,
    };
    const float length = __builtin_sqrtf(shaft.x * shaft.x + shaft.y * shaft.y + shaft.z * shaft.z);
    const float scale = LENGTH / length;
    const dibs_vec3 end = {tip.x + scale * shaft.x, tip.y + scale * shaft.y, tip.z + scale * shaft.z};
    return (dibs_tool){.start = tip, .end = end, .radius = RADIUS};
}
