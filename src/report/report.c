#include "report/report.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* --- JSON ----------------------------------------------------------------------------------------- */

void report_put_text(FILE *out, const char *s)
{
    if (!s) {
        fputs("null", out);
        return;
    }
    fputc('"', out);
    for (; *s; s++) {
        unsigned char c = (unsigned char)*s;
        if (c == '"' || c == '\\')
            fprintf(out, "\\%c", c);
        else if (c < 0x20)
            fprintf(out, "\\u%04x", c);
        else
            fputc(c, out);
    }
    fputc('"', out);
}

/* Nine digits hold every float32; what is no number is null. */
static void put_real(FILE *out, const char *name, double x)
{
    if (isfinite(x))
        fprintf(out, ",\"%s\":%.9g", name, x == 0 ? 0 : x);
    else
        fprintf(out, ",\"%s\":null", name);
}

static void put_int(FILE *out, const char *name, int64_t x) { fprintf(out, ",\"%s\":%lld", name, (long long)x); }

/* --- frames --------------------------------------------------------------------------------------- */

typedef enum FieldKind { FIELD_INT, FIELD_REAL } FieldKind;

static const struct {
    const char *name;
    FieldKind kind;
    size_t at;
} stat_field[] = {
#define INT(field) {#field, FIELD_INT, offsetof(FrameStat, field)}
#define REAL(field) {#field, FIELD_REAL, offsetof(FrameStat, field)}
    INT(components),
    INT(vertices_mechanical),
    INT(triangles_mechanical),
    INT(vertices_geometric),
    INT(triangles_geometric),
    REAL(edge_asked),
    REAL(edge_mean),
    REAL(edge_rest),
    REAL(edges_in_range),
    REAL(min_angle_p5),
    REAL(min_angle_p50),
    INT(predict_substeps),
    INT(splits),
    INT(collapses),
    INT(flips),
    INT(relax_steps),
    INT(cg_iterations),
    REAL(cg_residual),
    INT(projections_lost),
    INT(inverted_found),
    INT(inverted_left),
    INT(inverted_left_geometric),
    INT(frozen_vertices),
    INT(audit_components),
    INT(audit_euler),
    INT(mend_faults),
    INT(mend_patches),
    INT(replaced_vertices),
    INT(remade_components),
    INT(raw_components),
    INT(wrong_components),
    REAL(ids_kept),
    REAL(distance_mean_vox),
    REAL(distance_max_vox),
    INT(self_intersections),
    INT(flattened),
#undef INT
#undef REAL
};

static void put_stat(FILE *out, const FrameStat *stat)
{
    for (size_t i = 0; i < sizeof stat_field / sizeof *stat_field; i++) {
        const char *at = (const char *)stat + stat_field[i].at;
        double real;
        int whole;
        if (stat_field[i].kind == FIELD_REAL) {
            memcpy(&real, at, sizeof real);
            put_real(out, stat_field[i].name, real);
            continue;
        }
        memcpy(&whole, at, sizeof whole);
        put_int(out, stat_field[i].name, whole);
    }
}

static void put_event_counts(FILE *out, const int64_t count[EVENT_KINDS])
{
    fputs(",\"events\":{", out);
    for (int k = 0; k < EVENT_KINDS; k++)
        fprintf(out, "%s\"%s\":%lld", k ? "," : "", event_kind_name((EventKind)k), (long long)count[k]);
    fputc('}', out);
}

void report_write_settings(FILE *out, const char *version, int n, const ReportSetting *setting)
{
    fputs("{\"program\":\"twinmesh\",\"version\":", out);
    report_put_text(out, version);
    fputs(",\"settings\":{", out);
    for (int i = 0; i < n; i++) {
        if (i) fputc(',', out);
        report_put_text(out, setting[i].name);
        fputc(':', out);
        if (setting[i].is_number && setting[i].text)
            fputs(setting[i].text, out);
        else
            report_put_text(out, setting[i].text);
    }
    fputs("}}\n", out);
}

void report_write_frame(FILE *out, const char *label, FrameFate fate, const char *surface, const FrameStat *stat)
{
    static const char *const name[] = {"tracked", "held", "skipped"};
    fputs("{\"frame\":", out);
    report_put_text(out, label);
    fprintf(out, ",\"fate\":\"%s\"", name[fate]);
    if (surface) {
        fputs(",\"surface\":", out);
        report_put_text(out, surface);
    }
    if (fate == FRAME_TRACKED) {
        int64_t count[EVENT_KINDS];
        for (int k = 0; k < EVENT_KINDS; k++) count[k] = stat->events[k];
        put_stat(out, stat);
        put_event_counts(out, count);
    }
    fputs("}\n", out);
}

/* --- totals --------------------------------------------------------------------------------------- */

ReportTotals report_totals_zero(void)
{
    return (ReportTotals){.angle_p5_least = INFINITY, .ids_kept_least = INFINITY};
}

static void add_counts(ReportTotals *t, const FrameStat *s)
{
    t->exact += s->wrong_components == 0;
    t->empty += s->triangles_mechanical == 0;
    t->triangles_mechanical += s->triangles_mechanical;
    t->triangles_geometric += s->triangles_geometric;
    t->splits += s->splits;
    t->collapses += s->collapses;
    t->flips += s->flips;
    t->cg_iterations += s->cg_iterations;
    t->projections_lost += s->projections_lost;
    t->inverted_left += s->inverted_left;
    t->inverted_left_geometric += s->inverted_left_geometric;
    t->remade_components += s->remade_components;
    t->raw_components += s->raw_components;
    for (int k = 0; k < EVENT_KINDS; k++) t->events[k] += s->events[k];
}

static void add_qualities(ReportTotals *t, const FrameStat *s)
{
    t->nsurface++;
    t->edge_ratio_sum += s->edge_mean / s->edge_asked;
    t->angle_p5_sum += s->min_angle_p5;
    t->angle_p50_sum += s->min_angle_p50;
    t->angle_p5_least = real_min(t->angle_p5_least, s->min_angle_p5);
    t->distance_sum += s->distance_mean_vox;
    t->distance_max_vox = real_max(t->distance_max_vox, s->distance_max_vox);
    if (isnan(s->ids_kept)) return;
    t->nids++;
    t->ids_kept_sum += s->ids_kept;
    t->ids_kept_least = real_min(t->ids_kept_least, s->ids_kept);
}

void report_totals_add(ReportTotals *t, FrameFate fate, const FrameStat *stat, const StageSeconds *seconds)
{
    bool tracked = fate == FRAME_TRACKED;
#define ADD_STAGE(name) t->seconds.name += seconds->name;
    REPORT_STAGES(ADD_STAGE)
#undef ADD_STAGE
    t->frames += tracked;
    t->held += fate == FRAME_HELD;
    t->skipped += fate == FRAME_SKIPPED;
    if (!tracked) return;
    add_counts(t, stat);
    if (stat->triangles_mechanical) add_qualities(t, stat);
}

static double mean(double sum, int n) { return n ? sum / n : NAN; }

void report_write_totals(FILE *out, const ReportTotals *t, int nruns, const ReportRuns *runs, bool complete)
{
    fprintf(out, "{\"totals\":{\"complete\":%s", complete ? "true" : "false");
    put_int(out, "frames", t->frames);
    put_int(out, "held", t->held);
    put_int(out, "skipped", t->skipped);
    put_int(out, "empty", t->empty);
    put_int(out, "exact", t->exact);
    put_int(out, "triangles_mechanical", t->triangles_mechanical);
    put_int(out, "triangles_geometric", t->triangles_geometric);
    put_int(out, "splits", t->splits);
    put_int(out, "collapses", t->collapses);
    put_int(out, "flips", t->flips);
    put_int(out, "cg_iterations", t->cg_iterations);
    put_int(out, "projections_lost", t->projections_lost);
    put_int(out, "inverted_left", t->inverted_left);
    put_int(out, "inverted_left_geometric", t->inverted_left_geometric);
    put_int(out, "remade_components", t->remade_components);
    put_int(out, "raw_components", t->raw_components);
    put_real(out, "edge_mean_over_asked", mean(t->edge_ratio_sum, t->nsurface));
    put_real(out, "min_angle_p5_mean", mean(t->angle_p5_sum, t->nsurface));
    put_real(out, "min_angle_p5_least", t->angle_p5_least);
    put_real(out, "min_angle_p50_mean", mean(t->angle_p50_sum, t->nsurface));
    put_real(out, "ids_kept_mean", mean(t->ids_kept_sum, t->nids));
    put_real(out, "ids_kept_least", t->ids_kept_least);
    put_real(out, "distance_mean_vox", mean(t->distance_sum, t->nsurface));
    put_real(out, "distance_max_vox", t->nsurface ? t->distance_max_vox : NAN);
    put_event_counts(out, t->events);
    fputs(",\"runs\":{", out);
    for (int i = 0; i < nruns; i++) {
        fprintf(out, "%s\"%s\":{\"runs\":%d", i ? "," : "", runs[i].mesh, runs[i].runs);
        put_real(out, "median_run", runs[i].median_run);
        fputc('}', out);
    }
    fputs("}}}\n", out);
}

/* --- events --------------------------------------------------------------------------------------- */

static void put_numbers(FILE *out, const char *name, int n, const int32_t *number)
{
    fprintf(out, ",\"%s\":[", name);
    for (int i = 0; i < n; i++) fprintf(out, "%s%d", i ? "," : "", number[i]);
    fputc(']', out);
}

static void put_point(FILE *out, Vec3 p)
{
    for (int a = 0; a < 3; a++) fprintf(out, "%c%.9g", a ? ',' : '[', v_get(p, a) == 0 ? 0 : v_get(p, a));
    fputc(']', out);
}

static void put_components(FILE *out, const char *since, const FrameEvents *e)
{
    fputs(",\"kind\":\"components\",\"since\":", out);
    report_put_text(out, since);
    put_numbers(out, "before", e->nbefore, e->before);
    put_numbers(out, "after", e->nafter, e->after);
    fputs(",\"links\":[", out);
    for (int i = 0; i < e->nlink; i++) fprintf(out, "%s[%d,%d]", i ? "," : "", e->link[i][0], e->link[i][1]);
    fputc(']', out);
}

static void put_event(FILE *out, const FrameEvents *e, const FrameEvent *v)
{
    fprintf(out, ",\"kind\":\"%s\",\"place\":", event_kind_name(v->kind));
    put_point(out, e->place[v->place]);
    put_numbers(out, "before", v->nbefore, e->number + v->before);
    put_numbers(out, "after", v->nafter, e->number + v->after);
    put_int(out, "replaced", v->replaced);
    put_int(out, "count", v->count);
    fputs(",\"places\":[", out);
    for (int i = 0; i < v->nplace; i++) {
        if (i) fputc(',', out);
        put_point(out, e->place[v->place + i]);
    }
    fputc(']', out);
}

void events_write_frame(FILE *out, const char *label, const char *since, const FrameEvents *events)
{
    for (int i = -1; i < events->nevent; i++) {
        fputs("{\"frame\":", out);
        report_put_text(out, label);
        if (i < 0) put_components(out, since, events);
        else put_event(out, events, &events->event[i]);
        fputs("}\n", out);
    }
}

void events_write_totals(FILE *out, const ReportTotals *t, bool complete)
{
    fprintf(out, "{\"totals\":{\"complete\":%s", complete ? "true" : "false");
    put_int(out, "frames", t->frames);
    put_event_counts(out, t->events);
    fputs("}}\n", out);
}

/* --- times ---------------------------------------------------------------------------------------- */

StageSeconds report_stages(const FrameStat *stat)
{
    return (StageSeconds){.predict = stat->seconds.predict, .alter = stat->seconds.alter, .relax = stat->seconds.relax,
                          .audit = stat->seconds.audit, .mend = stat->seconds.mend, .refine = stat->seconds.refine};
}

/* Microseconds are enough for what varies from run to run. */
static void put_stages(FILE *out, const StageSeconds *seconds)
{
#define PUT_STAGE(name) fprintf(out, ",\"%s\":%.6f", #name, seconds->name);
    REPORT_STAGES(PUT_STAGE)
#undef PUT_STAGE
}

void timings_write_frame(FILE *out, const char *label, const StageSeconds *seconds)
{
    fputs("{\"frame\":", out);
    report_put_text(out, label);
    put_stages(out, seconds);
    fputs("}\n", out);
}

void timings_write_totals(FILE *out, const ReportTotals *t)
{
    fprintf(out, "{\"totals\":{\"frames\":%d", t->frames);
    put_stages(out, &t->seconds);
    fputs("}}\n", out);
}

/* --- for people ----------------------------------------------------------------------------------- */

static void summarise_events(FILE *out, const int64_t count[EVENT_KINDS])
{
    static const char *const name[EVENT_KINDS][2] = {
        {"blend", "blends"}, {"split", "splits"}, {"birth", "births"}, {"death", "deaths"},
        {"hole opened", "holes opened"}, {"hole closed", "holes closed"}, {"patch mended", "patches mended"}};
    fputs("  topology events           ", out);
    int kinds = 0;
    for (int k = 0; k < EVENT_KINDS; k++)
        if (count[k]) fprintf(out, "%s%lld %s", kinds++ ? ", " : "", (long long)count[k], name[k][count[k] != 1]);
    fputs(kinds ? "\n" : "none\n", out);
}

void report_summarise(FILE *out, const ReportTotals *t)
{
    fprintf(out, "%d frame%s", t->frames, t->frames == 1 ? "" : "s");
    if (t->held) fprintf(out, ", %d held", t->held);
    if (t->skipped) fprintf(out, ", %d skipped", t->skipped);
    if (t->seconds.whole > 0)
        fprintf(out, "; %.2f frames a second", (t->frames + t->held + t->skipped) / t->seconds.whole);
    fputc('\n', out);
    if (!t->frames) return;
    fprintf(out, "  triangles a frame         %.0f mechanical, %.0f geometric\n",
            (double)t->triangles_mechanical / t->frames, (double)t->triangles_geometric / t->frames);
    fprintf(out, "  exact topology            %d of %d frames\n", t->exact, t->frames);
    summarise_events(out, t->events);
    if (!t->nsurface) return;
    fprintf(out, "  minimum angle             %.1f deg 5th percentile, %.1f deg median\n", mean(t->angle_p5_sum, t->nsurface),
            mean(t->angle_p50_sum, t->nsurface));
    fprintf(out, "  mean edge / asked         %.3f\n", mean(t->edge_ratio_sum, t->nsurface));
    fprintf(out, "  distance to surface       %.3f voxel mean, %.3f largest\n", mean(t->distance_sum, t->nsurface),
            t->distance_max_vox);
    if (t->nids) fprintf(out, "  identities kept a frame   %.1f %%\n", 100 * mean(t->ids_kept_sum, t->nids));
}
