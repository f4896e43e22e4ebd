#include "check/check_priv.h"

#include <stdlib.h>

void spread_add(Spread *s, double value, double weight)
{
    RESERVE(s->item, s->cap, s->n + 1);
    s->item[s->n++] = (Weighed){value, weight};
}

static int compare(const void *pa, const void *pb)
{
    const Weighed *a = pa, *b = pb;
    if (a->value != b->value) return a->value < b->value ? -1 : 1;
    return a->weight < b->weight ? -1 : a->weight > b->weight;
}

void spread_sort(Spread *s)
{
    if (s->n) qsort(s->item, (size_t)s->n, sizeof *s->item, compare);
}

static double sum_of_weights(const Spread *s)
{
    double sum = 0;
    for (int i = 0; i < s->n; i++) sum += s->item[i].weight;
    return sum;
}

double spread_mean(const Spread *s)
{
    double sum = 0, weight = sum_of_weights(s);
    for (int i = 0; i < s->n; i++) sum += s->item[i].weight * s->item[i].value;
    return weight > 0 ? sum / weight : NAN;
}

double spread_quantile(const Spread *s, double q)
{
    double want = q * sum_of_weights(s), sum = 0;
    for (int i = 0; i < s->n; i++) {
        sum += s->item[i].weight;
        if (s->item[i].weight > 0 && sum >= want) return s->item[i].value;
    }
    return spread_most(s);
}

double spread_most(const Spread *s) { return s->n ? s->item[s->n - 1].value : NAN; }

void spread_free(Spread *s)
{
    mem_free(s->item);
    *s = (Spread){0};
}
