/* The flexible joint of the paper at 10 kHz, observers of order 2 in channels 2 and 4; the project's tests
 * hold it to the library's own design. */
#ifndef JOINT_DESIGN_H
#define JOINT_DESIGN_H

#include "edo_smc.h"

/* Gradient of a(x) and b, for a design on the chip. */
#define JOINT_GRADIENT 9667.02470461869, 0.0, -9667.02470461869, -75.18796992481204
#define JOINT_INPUT_GAIN 127.81954887218045

static const edo_smc_design_n4_r2_c24_t joint_design = {
    0x000100u, EDO_SMC_ID(4, 2, 0xa),
    {0.0f, 0.0f, 0.0f, 0.0f}, /* d_hat */
    10000.0f, /* rate */
    78.23529f, /* rate_n */
    0.50062656f, /* theta_n */
    {{0.019900333f, 9.900581e-5f}, {0.019900333f, 9.900581e-5f}}, /* gamma */
    {1000.0f, 300.0f, 30.0f, 1.0f}, /* c */
    {{30.0f, 9985.0f}, {0.0f, 0.0f}}, /* g */
    {0.0f, -7.844984f, -2.3527513f, -0.23156731f}, /* kx */
    -0.078372784f, /* kw */
    -0.3920599f, /* us */
    {{-2.3527513f, 6.5343316e-5f}, {-1.0f, 0.00025068969f}}, /* k */
    0.0f, /* satk */
    0.0f, /* lim */
    0.0009995002f, /* decay */
    -300.0f, /* u_min */
    300.0f, /* u_max */
    10.0f, /* sigma_star_bound */
    0.0f, /* hold */
    0.0f, /* fallback */
    0.0001f, /* period */
    127.81955f, /* input_gain */
    0.33396006f, /* mu2_n */
    {75.63025f, 0.0f, -75.63025f, -0.5882353f}, /* a_row */
};

#endif
