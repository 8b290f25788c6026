            if (!(monitor->braking > 0.0f)) {
                monitor->braking = 1.0f;
                monitor->stuck = 0.0f;
                monitor->over = 0.0f;
            }
