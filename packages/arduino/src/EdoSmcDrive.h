/* Position drive of a motor around its exported file edo_smc_drive.h: encoder counts in, current out.
 *
 *     EdoSmcDrive drive;
 *     drive.begin();                                  once, in setup()
 *     float ampere = drive.tick(count);               timer interrupt, every drive.period()
 *     drive.moveTo(1.0, 0.3);                         in loop(): 1 rad, in 0.3 s
 *     drive.setLimits(20.0, 400.0);                   in loop(): for set-points, rad/s and rad/s^2
 *     drive.setTarget(1.0);                           in loop(): at any time, as often as you like
 *
 * The tick may interrupt loop(). It needs a 32-bit core whose double has 64 bits. */
#ifndef EDO_SMC_DRIVE_CLASS_H
#define EDO_SMC_DRIVE_CLASS_H

#include "edo_smc_drive.h"

#if !defined(EDO_SMC_TORQUE_N_M_PER_A) || defined(EDO_SMC_STIFFNESS_N_M) || !defined(EDO_SMC_PROFILE_WINDOW)
#error "edo_smc_drive.h: export a [motor] in position mode, without --prefix"
#endif
static_assert(sizeof(double) == 8, "EdoSmcDrive needs a double of 64 bits; an AVR has none");

class EdoSmcDrive {
public:
    EdoSmcDrive()
        : ticks_(0u), playing_(0u), changeover_(0u), goal_turn_(0), goal_(0.0), health_(0u), follows_(FOLLOWS_PLAN),
          ready_(READY_NONE), started_(false), has_limits_(false)
    {
        state_ = edo_smc_state();
        monitor_ = edo_smc_monitor();
        sample_ = edo_smc_sample();
        plans_[0] = edo_smc_plan();
        plans_[1] = edo_smc_plan();
        profile_ = edo_smc_profile();
    }

    /* Returns false if the floating-point modes are not the assumed ones. */
    bool begin() { return edo_smc_modes_ok(); }

    /* Returns the control period, s. */
    static constexpr double period() { return EDO_SMC_PERIOD_S; }

    /* Interrupt: computes the current for a count, A. The first 10 ms give 0 A: the counts must agree first. */
    float tick(uint32_t count, bool is_lost = false)
    {
        edo_smc_output output;
        const uint32_t end = ticks_ + EDO_SMC_DELAY_TICKS + 1u;
        sample_.count = count;
        sample_.lost = is_lost;
        sample_.begin = sample_.end;
        take(end);
        target(end);
        health_ = edo_smc_watched_tick(&monitor_, &state_, &sample_, &output);
        edo_smc_estimates_of here;
        if ((health_ & EDO_SMC_WAITS) != 0u && edo_smc_estimates(&state_, &here)) {
            rest(here.turn, here.position);
        } else if (state_.started) {
            started_ = true;
        }
        ticks_ = ticks_ + 1u;
        return output.u;
    }

    /* Interrupt: reports the current that the stage holds, if it is another one. The only anti-windup, and required. */
    void applied(float ampere) { (void)edo_smc_report_applied(&state_, ampere); }

    /* Interrupt: reports control periods without a tick, before the next tick. Plans go on meanwhile. */
    void missed(uint32_t periods)
    {
        edo_smc_missed(&state_, periods);
        for (uint32_t k = 0u; k < periods; k++) {
            take(ticks_ + EDO_SMC_DELAY_TICKS + 1u);
            target(ticks_ + EDO_SMC_DELAY_TICKS + 1u);
            ticks_ = ticks_ + 1u;
        }
    }

    /* Interrupt, or with the interrupt masked: restarts after a stop, with the shaft at rest. Add the differences of the
     * counts up from tick to tick: two counts some time apart may be whole revolutions apart. The drive then holds its
     * present position. */
    void reset()
    {
        started_ = false;
        edo_smc_watched_reset(&monitor_, &state_);
    }

    /* loop(): moves to rest at an angle in a duration, also in motion. Returns false if the drive has not started, an
     * earlier request waits, a set-point moves, a number is invalid, or loop() took too long. */
    bool moveTo(double angle_rad, double duration_s)
    {
        const double ticks = duration_s / EDO_SMC_PERIOD_S + 0.5;
        edo_smc_jet present = {0, 0.0f, 0.0f, 0.0f};
        int32_t turn;
        double rest_rad;
        if (!started_ || ready_ != READY_NONE || !split(angle_rad, turn, rest_rad) ||
            !(ticks >= 1.0 && ticks <= 16777216.0)) {
            return false;
        }
        const uint32_t start = ticks_ + EDO_SMC_DELAY_TICKS + 2u + LEAD_TICKS;
        if (follows_ == FOLLOWS_PLAN) {
            edo_smc_plan_jet(&plans_[playing_], start, &present);
        } else if (edo_smc_profile_has_arrived(&profile_)) {
            present.turn = sample_.end.turn;
            present.r = sample_.end.r;
        } else {
            return false;
        }
        changeover_ = start;
        if (!edo_smc_plan_move(&plans_[playing_ ^ 1u], &present, start, (uint32_t)ticks, turn, (float)rest_rad)) {
            return false;
        }
        if ((int32_t)(start - (ticks_ + EDO_SMC_DELAY_TICKS + 1u)) <= 0) {
            return false;
        }
        hand_over(READY_PLAN);
        return true;
    }

    /* loop(): sets the largest speed and acceleration of set-points. It may be called while the drive follows a plan. */
    bool setLimits(double speed_rad_s, double acceleration_rad_s2)
    {
        if (follows_ != FOLLOWS_PLAN || ready_ != READY_NONE) {
            return false;
        }
        has_limits_ = edo_smc_profile_new(&profile_, speed_rad_s, acceleration_rad_s2, 1u);
        return has_limits_;
    }

    /* loop(): sets the goal of set-points, at any time. Returns false before setLimits, while a plan moves, and until the
     * tick has taken the previous request. */
    bool setTarget(double angle_rad)
    {
        int32_t turn;
        double rest_rad;
        if (!started_ || !has_limits_ || ready_ != READY_NONE || !split(angle_rad, turn, rest_rad) ||
            (follows_ == FOLLOWS_PLAN && isMoving())) {
            return false;
        }
        goal_turn_ = turn;
        goal_ = rest_rad;
        hand_over(READY_GOAL);
        return true;
    }

    /* Returns whether the target moves or a request waits. */
    bool isMoving() const
    {
        if (ready_ != READY_NONE) {
            return true;
        }
        return follows_ == FOLLOWS_PLAN ? plans_[playing_].ticks != 0u : !edo_smc_profile_has_arrived(&profile_);
    }

    /* Returns whether the drive has started: its counts agreed and current flows. */
    bool hasStarted() const { return started_; }

    /* Returns the status flags of the last tick, EDO_SMC_SATURATED and others of the exported file. */
    unsigned health() const { return health_; }

    /* Returns whether an alarm has stopped the drive. */
    bool hasStopped() const { return (health_ & EDO_SMC_STOPPED) != 0u; }

    /* Interrupt: estimated angle in rad, speed in rad/s and load torque in N m; 0 before the start. */
    double angle() const { return estimate(0); }
    double speed() const { return estimate(1); }
    double load() const { return estimate(2); }

private:
    enum Follows { FOLLOWS_PLAN, FOLLOWS_PROFILE };
    enum Ready { READY_NONE, READY_PLAN, READY_GOAL };
    /* Time of loop() to make a plan, in ticks of at least 10 ms. */
    static const uint32_t LEAD_TICKS = (uint32_t)(0.010 / EDO_SMC_PERIOD_S) + 1u;

    /* Splits an angle into revolutions and a rest. */
    static bool split(double angle_rad, int32_t &turn, double &rest_rad)
    {
        const double turns = angle_rad / 6.283185307179586;
        if (!(turns > -1.0e6 && turns < 1.0e6)) {
            return false;
        }
        turn = (int32_t)(turns + (turns < 0.0 ? -0.5 : 0.5));
        rest_rad = angle_rad - 6.283185307179586 * (double)turn;
        return true;
    }

    /* Everything is in memory before the interrupt sees the request. */
    void hand_over(Ready ready)
    {
        __atomic_thread_fence(__ATOMIC_SEQ_CST);
        ready_ = ready;
    }

    /* Takes a request of loop() at its tick. */
    void take(uint32_t end)
    {
        if (ready_ == READY_NONE) {
            return;
        }
        __atomic_thread_fence(__ATOMIC_SEQ_CST);
        if (ready_ == READY_PLAN && (int32_t)(end - changeover_) >= 0) {
            playing_ = playing_ ^ 1u;
            follows_ = FOLLOWS_PLAN;
            ready_ = READY_NONE;
        } else if (ready_ == READY_GOAL) {
            if (follows_ == FOLLOWS_PLAN) {
                (void)edo_smc_profile_start(&profile_, sample_.end.turn, (double)sample_.end.r, 0.0);
                follows_ = FOLLOWS_PROFILE;
            }
            (void)edo_smc_profile_go_to(&profile_, goal_turn_, goal_);
            ready_ = READY_NONE;
        }
    }

    void target(uint32_t end)
    {
        if (follows_ == FOLLOWS_PLAN) {
            edo_smc_plan_play(&plans_[playing_], end, &sample_.end);
        } else {
            edo_smc_profile_next(&profile_, &sample_.end);
        }
    }

    /* Start: no current flows yet. The drive holds the present position. */
    void rest(int32_t turn, float angle)
    {
        ready_ = READY_NONE;
        follows_ = FOLLOWS_PLAN;
        (void)edo_smc_plan_rest(&plans_[playing_], turn, angle);
        edo_smc_plan_at(&plans_[playing_], ticks_, &sample_.end);
    }

    double estimate(int which) const
    {
        edo_smc_estimates_of here;
        if (!edo_smc_estimates(&state_, &here)) {
            return 0.0;
        }
        const double position = 6.283185307179586 * (double)here.turn + (double)here.position;
        return which == 0 ? position : (double)(which == 1 ? here.speed : here.load);
    }

    edo_smc_state state_;
    edo_smc_monitor monitor_;
    edo_smc_sample sample_;
    edo_smc_plan plans_[2];
    edo_smc_profile profile_;
    volatile uint32_t ticks_;
    volatile unsigned playing_;
    uint32_t changeover_;
    int32_t goal_turn_;
    double goal_;
    volatile unsigned health_;
    volatile Follows follows_;
    volatile Ready ready_;
    volatile bool started_;
    bool has_limits_;
};

#endif
