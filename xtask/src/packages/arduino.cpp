/* EdoSmcDrive on a simulated rotor: a move, a missed tick, set-points, and a move after them. */
#include "EdoSmcDrive.h"
#include <math.h>
#include <stdio.h>

static EdoSmcDrive drive;
static double angle = 3.0 * 6.283185307179586 + 0.2;
static double speed, ampere;
static unsigned flags;

static void advance()
{
    for (int k = 0; k < 50; k++) {
        const double step = EDO_SMC_PERIOD_S / 50.0;
        speed += step / EDO_SMC_INERTIA_KG_M2 *
                 (EDO_SMC_TORQUE_N_M_PER_A * ampere - EDO_SMC_DAMPING_N_M_S * speed);
        angle += step * speed;
    }
}

static void run(int ticks)
{
    for (int k = 0; k < ticks; k++) {
        ampere = (double)drive.tick((uint32_t)(int64_t)floor(angle / EDO_SMC_ENCODER_UNIT_RAD + 0.5));
        advance();
        flags |= drive.health();
    }
}

static int failures;
static void check(const char *claim, bool holds, double value)
{
    printf("%-44s %9.5f %s\n", claim, value, holds ? "ok" : "FAILED");
    failures += holds ? 0 : 1;
}

int main()
{
    const double begin = 0.2; /* the drive cannot count the revolutions before its start */
    check("modes", drive.begin(), 0.0);
    check("no move before the start", !drive.moveTo(1.0, 0.2), 0.0);
    run(50);
    check("started", drive.hasStarted() && !drive.isMoving(), 0.0);
    check("holds the angle of the start, rad", fabs(drive.angle() - begin) < 1e-3, drive.angle());
    check("takes a move", drive.moveTo(7.0, 0.3) && drive.isMoving(), 0.0);
    run(100);
    check("no set-point during a move", !drive.setTarget(0.0), 0.0);
    flags = 0u;
    for (int k = 0; k < 3; k++) {
        advance(); /* three periods without a tick, at a speed of 30 rad/s */
    }
    drive.missed(3u);
    run(400);
    check("missed ticks cost no count", (flags & (EDO_SMC_SAMPLE_LOST | EDO_SMC_POSITION_STEPPED)) == 0u, (double)flags);
    check("rests at the target, rad", fabs(drive.angle() - 7.0) < 1e-3 && !drive.isMoving(), drive.angle());
    check("no alarm", (drive.health() & ~(unsigned)(EDO_SMC_HUNTS)) == 0u, (double)drive.health());
    check("takes limits", drive.setLimits(20.0, 400.0), 0.0);
    check("takes a set-point", drive.setTarget(-2.0), 0.0);
    run(100);
    check("takes another one in motion", drive.isMoving() && drive.setTarget(3.0), drive.angle());
    check("no plan while set-points move", !drive.moveTo(1.0, 0.2), 0.0);
    run(1000);
    check("rests at the set-point, rad", fabs(drive.angle() - 3.0) < 1e-3 && !drive.isMoving(), drive.angle());
    check("takes a move again", drive.moveTo(0.5, 0.3), 0.0);
    run(500);
    check("rests at the target, rad", fabs(drive.angle() - 0.5) < 1e-3 && !drive.isMoving(), drive.angle());
    drive.reset();
    run(50);
    check("starts again where it stands, rad", drive.hasStarted() && fabs(drive.angle() - 0.5) < 1e-3, drive.angle());
    check("no invalid target", !drive.moveTo(NAN, 0.3) && !drive.moveTo(1.0, NAN) && !drive.setTarget(NAN), 0.0);
    return failures;
}
