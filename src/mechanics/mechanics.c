#include "mechanics/mechanics_priv.h"

MechanicsSettings mechanics_defaults(void)
{
    return (MechanicsSettings){.kind = MECHANICS_FEM, .young = 1000, .poisson = 0.3, .spring = 100, .dt = 0.04,
                               .rest = 1, .cg_iterations = 7, .cg_tolerance = 1e-2, .sharp = true};
}

static MechanicsScratch *scratch_of(Mechanics *mech)
{
    if (!mech->scratch) mech->scratch = NEW0(MechanicsScratch, 1);
    return mech->scratch;
}

static void check(const MechanicsSettings *set, const MechanicsProblem *prob)
{
    ASSERT(set->rest > 0 && set->dt > 0 && set->cg_iterations >= 0 && set->cg_tolerance >= 0);
    ASSERT(prob->nvert >= 0 && prob->ntri >= 0);
    ASSERT(prob->nvert == 0 || (prob->pos && prob->normal));
    ASSERT(prob->ntri == 0 || prob->tri);
    (void)set;
    (void)prob;
}

CgStat mechanics_step(Mechanics *mech, const MechanicsSettings *set, const MechanicsProblem *prob, Vec3 *dx)
{
    check(set, prob);
    MechanicsScratch *sc = scratch_of(mech);
    elastic_build(&sc->elastic, set, prob, false);
    sharp_build(&sc->sharp, &sc->elastic);
    CgStat st = cg_solve(&sc->cg, &sc->elastic, &sc->sharp);
    /* where frozen, x[nfree] = 0 */
    for (int v = 0; v < prob->nvert; v++) dx[v] = sc->cg.x[sc->elastic.local[v]];
    return st;
}

void mechanics_forces(Mechanics *mech, const MechanicsSettings *set, const MechanicsProblem *prob, Vec3 *f)
{
    check(set, prob);
    Elastic *el = &scratch_of(mech)->elastic;
    elastic_build(el, set, prob, true);
    for (int v = 0; v < prob->nvert; v++) f[v] = elastic_gather(el, v);
}

void mechanics_free(Mechanics *mech)
{
    if (!mech->scratch) return;
    elastic_free(&mech->scratch->elastic);
    sharp_free(&mech->scratch->sharp);
    cg_free(&mech->scratch->cg);
    mem_free(mech->scratch);
    mech->scratch = NULL;
}
