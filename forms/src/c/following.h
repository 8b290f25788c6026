    const float error = ((float)@_signed((uint32_t)sample->begin.turn - turn) * full_turn) +
                        (sample->begin.r - known.position$shaft$);
    broken |= (@_magnitude(error) <= $most$) ? 0u : (unsigned)@@_FOLLOWING_ERROR;
