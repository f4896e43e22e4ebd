/* sets.h: disjoint sets of 0 ... n-1 as a forest: up[i] leads towards the set's least member, its root. Start with up[i] = i. */
#pragma once
#include "base/base.h"

static inline int set_root(int32_t *up, int i)
{
    while (up[i] != i) i = up[i] = up[up[i]];
    return i;
}

static inline void set_join(int32_t *up, int a, int b)
{
    a = set_root(up, a);
    b = set_root(up, b);
    up[int_max(a, b)] = int_min(a, b);
}
