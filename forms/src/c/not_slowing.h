    const float sigma = @_magnitude(output->sigma);
    const float current = output->u;
    const bool is_at_limit = (told & @@_SATURATED) != 0u;
