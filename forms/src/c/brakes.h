        if (is_rejected && is_lost) {
            health |= @_watch_stop(monitor, output);
        } else {
            /* If encoder or phases are reversed, braking accelerates the shaft: wait some ticks for that alarm. */
            if (!(monitor->against > 0.0f)) {
                @_watch_brakes(monitor);
            }
        }
