/* Design of a sliding mode controller with an extended disturbance observer: n = 4, observers of order up to 2 in channels 2, 4, T = 0.0001 s.
 * Exported for version 0.1.0 of the archive; do not edit, export it again.
 *
 * Design 0xe4c45115 (CRC-32, the one a target reports).
 * Scenario joint.toml (CRC-32 0x97fb56c5):
 *
 *     # The joint of the examples: 10 kHz, all three roots of the surface at -10, both poles of each observer at -100.
 *     #     host-sim export joint.toml --lang c --prefix joint -o joint_design.h --force
 *     #     host-sim export joint.toml --standalone --prefix joint -o joint_standalone.h --force
 *     name = "joint"
 *
 *     [plant]
 *     kind = "flexible_joint"
 *     reading = "reconstructed"
 *
 *     [controller]
 *     period_s = 1e-4
 *     surface_bandwidth_rad_s = 10.0
 *     alpha_per_s = 10.0
 *     k_l = 50.0
 *     limits = { min = -300.0, max = 300.0 }
 *     fallback = 0.0
 *     sigma_star_bound = 10.0
 *
 *     [[controller.observer]]
 *     channel = 2
 *     bandwidth_rad_s = 100.0
 *     order = 2
 *
 *     [[controller.observer]]
 *     channel = 4
 *     bandwidth_rad_s = 100.0
 *     order = 2
 */
#ifdef JOINT_DESIGN_H
#if JOINT_DESIGN_H != 0xe4c45115u
#error "two designs with the prefix joint, 0xe4c45115u here and JOINT_DESIGN_H before: export one with another --prefix"
#define JOINT_DESIGN_H 0xe4c45115u
#endif
#else
#define JOINT_DESIGN_H 0xe4c45115u

#include "edo_smc.h"

static const edo_smc_design_n4_r2_c24_t joint_design = {
    0x000100u, EDO_SMC_ID(4, 2, 0xa),
    {0.0f, 0.0f, 0.0f, 0.0f}, /* d_hat */
    10000.0f, /* rate */
    78.23529f, /* rate_n */
    0.50062656f, /* theta_n */
    {{0.019900333f, 9.900581e-5f}, {0.019900333f, 9.900581e-5f}}, /* gamma */
    {1000.0f, 300.0f, 30.0f, 1.0f}, /* c */
    {{30.0f, 9985.0f}, {0.0f, 0.0f}}, /* g */
    {0.0f, -4.9723494e30f, -1.4912333e30f, -1.4677322e29f}, /* kx */
    -4.9674653e28f, /* kw */
    -2.4849748e29f, /* us */
    {{-1.4912333e30f, 4.1416247e25f}, {-6.338253e29f, 1.5889347e26f}}, /* k */
    0.0f, /* satk */
    0.0f, /* lim */
    1.5777218e-30f, /* unit */
    0.0009995002f, /* decay */
    -300.0f, /* u_min */
    300.0f, /* u_max */
    153600.0f, /* plausible */
    0.3136871f, /* ko */
    10.0f, /* sigma_star_bound */
    0.0f, /* hold */
    0.0f, /* fallback */
    0.0001f, /* period */
    127.81955f, /* input_gain */
    0.33396006f, /* mu2_n */
    {75.63025f, 0.0f, -75.63025f, -0.5882353f}, /* a_row */
    7744700.0f, /* check */
};

#endif
