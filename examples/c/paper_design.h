/* Design of a sliding mode controller with an extended disturbance observer: n = 4, observers of order up to 2 in channels 2, 4, T = 0.0001 s.
 * Exported for version 0.1.0 of the archive. Do not edit; export again.
 *
 * Design 0x8afd7ad8 (FNV-1a; `design_hash` in the run.json of a run).
 * Scenario paper.toml (CRC-32 0x2bacc204):
 *
 *     # The paper's law on the state of a joint, the numbers of Table I as a joint has them: 10 kHz, all three roots of the
 *     # surface at -10, both poles of each observer at -100.
 *     #     host-sim export paper.toml --lang c --prefix paper -o paper_design.h --force
 *     #     host-sim export paper.toml --standalone --prefix paper -o paper_standalone.h --force
 *     #     host-sim export paper.toml --asm --prefix paper -o paper_assembly.S --force
 *     name = "paper"
 *
 *     [plant]
 *     kind = "flexible_joint"
 *     reading = "physical"
 *
 *     [controller]
 *     period_s = 1e-4
 *     surface_bandwidth_rad_s = 10.0
 *     alpha_per_s = 10.0
 *     k_l = 50.0
 *     limits = { min = -30.0, max = 30.0 }
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
#ifdef PAPER_DESIGN_H
#if PAPER_DESIGN_H != 0xa1f664e9u
#error "two designs with the prefix paper, 0xa1f664e9u here and PAPER_DESIGN_H before: export one with another --prefix"
#define PAPER_DESIGN_H 0xa1f664e9u
#endif
#else
#define PAPER_DESIGN_H 0xa1f664e9u

#include "edo_smc.h"

static const edo_smc_design_n4_r2_c24_t paper_design = {
    0x000100u, EDO_SMC_ID(4, 2, 0xa),
    {0.0f, 0.0f, 0.0f, 0.0f}, /* d_hat */
    10000.0f, /* rate */
    1.9993464f, /* rate_n */
    0.50062656f, /* theta_n */
    {{0.019900333f, 9.900581e-5f}, {0.019900333f, 9.900581e-5f}}, /* gamma */
    {1000.0f, 300.0f, 30.0f, 1.0f}, /* c */
    {{30.0f, 9985.0f}, {0.0f, 0.0f}}, /* g */
    {0.0f, -2.0705543e30f, -6.0974875e29f, -6.001394e28f}, /* kx */
    -2.0311413e28f, /* kw */
    -1.0160785e29f, /* us */
    {{-6.0974875e29f, 1.6934643e25f}, {-1.0141205e31f, 2.5422954e27f}}, /* k */
    0.0f, /* satk */
    0.0f, /* lim */
    9.8607613e-32f, /* unit */
    0.0009995002f, /* decay */
    -30.0f, /* u_min */
    30.0f, /* u_max */
    15360.0f, /* plausible */
    0.008016448f, /* ko */
    10.0f, /* sigma_star_bound */
    0.0f, /* hold */
    0.0f, /* fallback */
    0.0001f, /* period */
    5001.6343f, /* input_gain */
    0.33396006f, /* mu2_n */
    {75.63025f, 0.0f, -1.9327731f, -0.01503268f}, /* a_row */
    6324346.0f, /* check */
};

#endif
