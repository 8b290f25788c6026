    const float error = ((float)@_signed((uint32_t)sample->begin.turn - turn) * full_turn) +
                        (sample->begin.r - known.position$shaft$);
    const float r_dot = sample->begin.r_dot;
