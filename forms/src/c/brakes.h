        if (is_rejected && is_lost) {
            health |= @_watch_stop(monitor, output);
        } else {
            /* To brake makes it worse if the shaft goes the wrong way: that is known in a few ticks. */
            if (!(monitor->against > 0.0f)) {
                @_watch_brakes(monitor);
            }
        }
