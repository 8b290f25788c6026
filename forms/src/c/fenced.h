    if (state->started && ((health & (@@_WAITS | @@_STOPPED)) == 0u)) {
        const unsigned broken = @_limits_broken(state, sample);
        health |= broken;
        if (broken != 0u) {
            @_watched_trip(monitor);
        }
    }
