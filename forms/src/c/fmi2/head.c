#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("fp-contract=off")
#elif !defined(_MSC_VER)
#pragma STDC FP_CONTRACT OFF
#endif
#include "fmi2Functions.h"
