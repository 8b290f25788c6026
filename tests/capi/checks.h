/* Counts the passed checks and prints the failed ones. */
#include <stdio.h>

static int checks, failed;

static void expect_at(int line, long expected, long found) {
    checks++;
    if (found != expected) {
        failed++;
        printf("line %d: %ld, expected %ld\n", line, found, expected);
    }
}

#define EXPECT(expected, found) expect_at(__LINE__, expected, found)

static int checked(void) {
    printf("%d checks, %d failed\n", checks, failed);
    return failed != 0;
}
