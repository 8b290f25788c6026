    if (!(monitor->braking > 0.0f)) {
        @_watch_brakes(monitor);
    }
