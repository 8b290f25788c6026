/* slew.elf is this, linked by GCC 12 at -O2 for a Cortex-M4F to 0x08000000 and stripped of all but its one symbol. */
float slew(float *y, float x, float limit)
{
    float step = x - *y;
    if (step > limit)
        step = limit;
    return *y += step;
}
