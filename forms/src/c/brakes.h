    alarms |= (is_rejected && is_late) ? (unsigned)@@_INPUT_REJECTED : 0u;
    /* To brake makes it worse if the shaft goes the wrong way: that is known in a few ticks. */
    const bool is_alarm = ((alarms & $bits$u) != 0u) && !(monitor->against > 0.0f);
    bool brakes = false;
    if (is_braking) {
        monitor->braking += is_short ? 0.0f : 1.0f;
        brakes = !is_stuck && !is_late && (monitor->braking <= $brake_ticks$f);
    } else {
        if (is_alarm && !is_blind) {
            brakes = true;
            monitor->braking = 1.0f;
            monitor->stuck = 0.0f;
            monitor->over = 0.0f;
        }
    }
    if (brakes) {
        state->$held$ = slowing;
        state->offset = 0.0f;
        output->u = slowing;
        health &= ~(unsigned)@@_SATURATED;
        health |= is_short ? (unsigned)(@@_SATURATED | @@_BRAKES) : (unsigned)@@_BRAKES;
    } else {
        if (is_braking || is_alarm) {
            health |= @_watch_stop(monitor, output);
        }
    }
