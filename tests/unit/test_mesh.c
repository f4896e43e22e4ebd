/* The half-edge mesh: its invariant, edits that keep it, components, sweeping. */
#include "mesh_shapes.h"

static Mesh mesh_of(Shape s)
{
    Mesh m;
    mesh_init(&m);
    mesh_take(&m, s, vec3(0, 0, 0));
    return m;
}

static Mesh tetrahedron(void)
{
    static const Vec3 pos[4] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    static const int32_t tri[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    Mesh m;
    mesh_init(&m);
    mesh_append(&m, 4, pos, NULL, 4, tri);
    return m;
}

/* --- building ---------------------------------------------------------------------------------------------------------- */

static void appended_shapes_are_closed_components(void **state)
{
    (void)state;
    Mesh m = mesh_of(shape_sphere(1));
    mesh_take(&m, shape_torus(8, 6, 2, 0.5), vec3(5, 0, 0));
    Mesh tet = tetrahedron();
    mesh_append(&m, 4, tet.pos, (const int32_t[4]){100, 7, 200, 9}, 4, tet.corner);
    assert_mesh(&m);
    assert_int_equal(mesh_components(&m, NULL, NULL), 3);
    assert_int_equal(mesh_euler(&m, 0), 2);
    assert_int_equal(mesh_euler(&m, 1), 0);
    assert_int_equal(mesh_euler(&m, 2), 2);
    for (int v = 0; v < 18 + 48; v++) assert_int_equal(m.id[v], MESH_ID_STEP * v); /* fresh ones, given out in order */
    assert_int_equal(m.next_id, MESH_ID_STEP * (18 + 48));
    assert_int_equal(m.id[18 + 48 + 2], 200);
    for (int h = 0; h < 3 * m.ntri; h++) assert_true(m.length[h] < 0 && m.flag[h] == 0);
    assert_true(mesh_volume(&tet) > 0);
    assert_int_equal(mesh_valence(&m, 0), 4);
    mesh_clear(&m);
    assert_true(m.nvert == 0 && m.ntri == 0 && m.next_id == MESH_ID_STEP * (18 + 48));
    assert_mesh(&m);
    assert_int_equal(mesh_components(&m, NULL, NULL), 0);
    mesh_free(&m);
    mesh_free(&tet);
}

static void check_finds_what_is_broken(void **state)
{
    (void)state;
    for (int kind = 0; kind < 6; kind++) {
        Mesh m = mesh_of(shape_sphere(1));
        assert_null(mesh_check(&m));
        switch (kind) {
        case 0: m.opp[5] = m.opp[4]; break;
        case 1: m.corner[7] = m.corner[8]; break;
        case 2: m.corner[0] = m.nvert; break;
        case 3: m.out[3] = (m.out[3] + 1) % (3 * m.ntri); break;
        case 4: m.out[3] = NONE; break;
        case 5: mesh_take(&m, shape_sphere(0), vec3(0, 0, 0)); /* a vertex with two umbrellas */
            for (int h = 3 * 32; h < 3 * m.ntri; h++)
                if (m.corner[h] == 18) m.corner[h] = 0;
            m.out[18] = NONE;
            break;
        }
        assert_non_null(mesh_check(&m));
        mesh_free(&m);
    }
}

static void components_can_be_dropped(void **state)
{
    (void)state;
    Mesh m = mesh_of(shape_sphere(1));
    mesh_take(&m, shape_torus(8, 6, 2, 0.5), vec3(5, 0, 0));
    mesh_take(&m, shape_sphere(0), vec3(0, 5, 0));
    int32_t comp[300];
    mesh_components(&m, comp, NULL);
    mesh_drop_components(&m, comp, (const uint8_t[]){0, 1, 0});
    assert_mesh(&m);
    assert_int_equal(m.deadvert, 48);
    assert_int_equal(m.deadtri, 96);
    int32_t vert[100];
    assert_int_equal(mesh_components(&m, comp, vert), 2);
    assert_true(comp[32] == NONE && vert[20] == NONE && vert[17] == 0 && vert[18 + 48] == 1);
    mesh_compact(&m, NULL);
    assert_mesh(&m);
    assert_true(m.nvert == 18 + 6 && m.ntri == 32 + 8 && m.id[18] == MESH_ID_STEP * (18 + 48));
    mesh_free(&m);
}

/* --- single edits ------------------------------------------------------------------------------------------------------ */

/* The edges around an edit are flagged, their lengths unknown; all others as they were. */
static void split_puts_a_vertex_on_an_edge(void **state)
{
    (void)state;
    Mesh m = mesh_of(shape_sphere(0));
    for (int h = 0; h < 24; h++) m.length[h] = 1;
    int h = find_edge(&m, 0, 1);
    int v = mesh_split_edge(&m, h, vec3(0.5, 0.5, 0), 77);
    assert_mesh(&m);
    assert_true(v == 6 && m.id[v] == 77 && m.pos[v].x == 0.5);
    assert_true(m.nvert == 7 && m.ntri == 10 && mesh_euler(&m, NONE) == 2);
    assert_int_equal(mesh_valence(&m, v), 4);
    assert_int_equal(find_edge(&m, 0, 1), NONE);
    for (int k = 0; k < 3 * m.ntri; k++) {
        bool changed = he_from(&m, k) == v || he_to(&m, k) == v;
        assert_int_equal(m.flag[k], changed ? EDGE_FLAGGED : 0);
        assert_true(m.length[k] == (changed ? -1.0f : 1.0f));
    }
    mesh_free(&m);
}

static void collapse_joins_into_the_first_end(void **state)
{
    (void)state;
    Mesh m = mesh_of(shape_sphere(1));
    for (int h = 0; h < 3 * m.ntri; h++) m.length[h] = 1;
    int h = m.out[0], a = he_from(&m, h), b = he_to(&m, h);
    assert_true(mesh_can_collapse(&m, h));
    mesh_collapse_edge(&m, h, vec3(9, 9, 9));
    assert_mesh(&m);
    assert_true(vert_is_dead(&m, b) && !vert_is_dead(&m, a) && m.pos[a].x == 9 && m.id[a] == 0);
    assert_true(m.deadvert == 1 && m.deadtri == 2 && mesh_euler(&m, NONE) == 2);
    for (int k = 0; k < 3 * m.ntri; k++) {
        if (tri_is_dead(&m, k / 3)) continue;
        bool changed = he_from(&m, k) == a || he_to(&m, k) == a;
        assert_int_equal(m.flag[k], changed ? EDGE_FLAGGED : 0);
        assert_true(m.length[k] == (changed ? -1.0f : 1.0f));
    }
    mesh_free(&m);
}

static void flip_turns_the_diagonal(void **state)
{
    (void)state;
    Mesh m = mesh_of(shape_torus(6, 5, 2, 0.5));
    for (int h = 0; h < 3 * m.ntri; h++) m.length[h] = (float)mesh_edge_length(&m, h);
    int h = find_edge(&m, 0, 6), c = m.corner[he_prev(h)], d = m.corner[he_prev(m.opp[h])];
    assert_true(mesh_can_flip(&m, h));
    mesh_flip_edge(&m, h);
    assert_mesh(&m);
    assert_int_equal(find_edge(&m, 0, 6), NONE);
    int f = find_edge(&m, c, d);
    assert_true(f != NONE && m.flag[f] == EDGE_FLAGGED && m.length[f] == -1);
    int flagged = 0;
    for (int k = 0; k < 3 * m.ntri; k++) {
        flagged += m.flag[k];
        if (!m.flag[k]) assert_true(m.length[k] == (float)mesh_edge_length(&m, k));
    }
    assert_int_equal(flagged, 2);
    assert_int_equal(mesh_euler(&m, NONE), 0);
    mesh_free(&m);
}

/* --- what may not be --------------------------------------------------------------------------------------------------- */

static void tetrahedron_allows_nothing(void **state)
{
    (void)state;
    Mesh m = tetrahedron();
    for (int h = 0; h < 12; h++) assert_false(mesh_can_collapse(&m, h) || mesh_can_flip(&m, h));
    mesh_free(&m);
}

/* Down to four triangles and no further, by whichever edges. */
static void sphere_collapses_to_a_tetrahedron(void **state)
{
    (void)state;
    Mesh m = mesh_of(shape_sphere(2));
    for (bool any = true; any;) {
        any = false;
        for (int h = 0; h < 3 * m.ntri; h++) {
            if (tri_is_dead(&m, h / 3) || !mesh_can_collapse(&m, h)) continue;
            mesh_collapse_edge(&m, h, m.pos[he_from(&m, h)]);
            any = true;
        }
    }
    mesh_compact(&m, NULL);
    assert_mesh(&m);
    assert_true(m.nvert == 4 && m.ntri == 4);
    mesh_free(&m);
}

/* GI'07 figure 3: the edge's ends have a third common neighbour, across a neck of three edges: its collapse would
 * pinch the neck. A torus that is three vertices around its tube has such necks everywhere. */
static void neck_is_not_pinched(void **state)
{
    (void)state;
    enum { NU = 7 };
    Mesh m = mesh_of(shape_torus(NU, 3, 2, 0.5));
    assert_mesh(&m);
    for (int h = 0; h < 3 * m.ntri; h++) {
        bool around_the_neck = he_from(&m, h) / 3 == he_to(&m, h) / 3;
        assert_int_equal(mesh_can_collapse(&m, h), !around_the_neck);
    }
    mesh_free(&m);
}

/* Two pyramids on a triangle: an end of valence three behind the collapse would become two. */
static void double_triangles_do_not_arise(void **state)
{
    (void)state;
    static const Vec3 pos[5] = {{1, 0, 0}, {-0.5, 0.8, 0}, {-0.5, -0.8, 0}, {0, 0, 1}, {0, 0, -1}};
    static const int32_t tri[18] = {0, 1, 3, 1, 2, 3, 2, 0, 3, 1, 0, 4, 2, 1, 4, 0, 2, 4};
    Mesh m;
    mesh_init(&m);
    mesh_append(&m, 5, pos, NULL, 6, tri);
    assert_mesh(&m);
    for (int h = 0; h < 18; h++) {
        int a = he_from(&m, h), b = he_to(&m, h);
        bool rim = a < 3 && b < 3;
        assert_int_equal(mesh_can_collapse(&m, h), !rim); /* the rim's wings have valence three */
        if (!rim) assert_false(mesh_can_flip(&m, h));     /* an end has */
        else assert_true(mesh_can_flip(&m, h));
    }
    mesh_free(&m);
}

/* --- many edits ---------------------------------------------------------------------------------------------------------- */

static void assert_symmetric(const Mesh *m)
{
    for (int h = 0; h < 3 * m->ntri; h++) {
        if (tri_is_dead(m, h / 3)) continue;
        assert_true(m->flag[h] == m->flag[m->opp[h]] && m->length[h] == m->length[m->opp[h]]);
    }
}

/* An edit of a kind at random at an edge at random. False: not allowed there. */
static bool edit(Mesh *m, uint64_t *seed, int most)
{
    int h = (int)((shape_noise(seed) + 0.5) * 3 * m->ntri), live = m->nvert - m->deadvert;
    double kind = shape_noise(seed) + 0.5;
    if (tri_is_dead(m, h / 3)) return false;
    if (kind < 0.3) {
        if (!mesh_can_flip(m, h)) return false;
        mesh_flip_edge(m, h);
    } else if (kind < 0.3 + 0.7 * live / (2.0 * most)) {
        if (!mesh_can_collapse(m, h)) return false;
        mesh_collapse_edge(m, h, v_mid(m->pos[he_from(m, h)], m->pos[he_to(m, h)]));
    } else {
        mesh_split_edge(m, h, v_mid(m->pos[he_from(m, h)], m->pos[he_to(m, h)]), m->next_id++);
    }
    return true;
}

static void thousands_of_edits_keep_the_invariant(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 4; seed++) {
        uint64_t s = seed;
        int most = seed % 2 ? 30 : 250, done = 0; /* small meshes come to the limits of what is allowed */
        Mesh m;
        mesh_init(&m);
        mesh_take(&m, shape_sphere(2), vec3(0, 0, 0));
        mesh_take(&m, shape_torus(12, 6, 2, 0.5), vec3(8, 0, 0));
        for (int h = 0; h < 3 * m.ntri; h++) m.length[h] = (float)mesh_edge_length(&m, h);
        for (int i = 0; i < 8000; i++) {
            done += edit(&m, &s, most);
            if (i % 40) continue;
            assert_mesh(&m);
            assert_symmetric(&m);
            assert_int_equal(mesh_components(&m, NULL, NULL), 2);
            int first = mesh_euler(&m, 0);
            assert_int_equal(first + mesh_euler(&m, 1), 2);
            assert_true(first == 0 || first == 2); /* numbered by first triangle: either may come first */
            if (i % 1000 == 0) mesh_compact(&m, NULL);
        }
        assert_in_range(done, 2000, 8000);
        mesh_free(&m);
    }
}

/* --- sweeping ------------------------------------------------------------------------------------------------------------ */

static void compact_says_where_everything_went(void **state)
{
    (void)state;
    uint64_t seed = 3;
    Mesh m = mesh_of(shape_sphere(3));
    for (int h = 0; h < 3 * m.ntri; h++) m.length[h] = (float)mesh_edge_length(&m, h);
    for (int i = 0; i < 2000; i++) edit(&m, &seed, 40);
    int n = m.nvert, live = n - m.deadvert, tris = m.ntri - m.deadtri;
    assert_true(m.deadvert > 100);
    Vec3 *pos = NEW(Vec3, n);
    int32_t *id = NEW(int32_t, n), *to = NEW(int32_t, n);
    uint8_t *dead = NEW(uint8_t, n);
    for (int v = 0; v < n; v++) pos[v] = m.pos[v], id[v] = m.id[v], dead[v] = vert_is_dead(&m, v);
    mesh_compact(&m, to);
    assert_mesh(&m);
    assert_symmetric(&m);
    assert_true(m.nvert == live && m.ntri == tris && m.deadvert == 0 && m.deadtri == 0);
    for (int v = 0, next = 0; v < n; v++) {
        assert_int_equal(to[v], dead[v] ? NONE : next);
        if (dead[v]) continue;
        assert_true(m.id[next] == id[v] && v_dist(m.pos[next], pos[v]) == 0);
        next++;
    }
    for (int h = 0; h < 3 * m.ntri; h++) /* lengths went along */
        if (m.length[h] >= 0) assert_near((double)m.length[h], mesh_edge_length(&m, h), 1e-6);
    mesh_compact(&m, to); /* nothing to sweep */
    for (int v = 0; v < live; v++) assert_int_equal(to[v], v);
    mem_free(pos);
    mem_free(id);
    mem_free(to);
    mem_free(dead);
    mesh_free(&m);
}

static int least_vertex(const Mesh *m, int t)
{
    const int32_t *c = m->corner + 3 * t;
    return int_min(int_min(c[0], c[1]), c[2]);
}

static void sort_puts_what_has_a_key_together(void **state)
{
    (void)state;
    enum { KEYS = 7 };
    uint64_t seed = 5;
    Mesh m = mesh_of(shape_sphere(3));
    for (int i = 0; i < 500; i++) edit(&m, &seed, 400);
    mesh_compact(&m, NULL);
    for (int h = 0; h < 3 * m.ntri; h++) m.length[h] = (float)mesh_edge_length(&m, h);
    int n = m.nvert;
    int32_t *key = NEW(int32_t, n), *to = NEW(int32_t, n), *id = NEW(int32_t, n), *at = NEW(int32_t, n);
    for (int v = 0; v < n; v++) key[v] = m.id[v] % 11 % KEYS, id[v] = m.id[v];
    mesh_sort(&m, KEYS, key, to);
    assert_mesh(&m);
    assert_symmetric(&m);
    assert_int_equal(m.nvert, n);
    assert_int_equal(m.nsorted, n);
    for (int v = 0; v < n; v++) {
        assert_int_equal(m.id[to[v]], id[v]);
        at[to[v]] = v;
    }
    for (int v = 1; v < n; v++) assert_true(key[at[v - 1]] < key[at[v]] || (key[at[v - 1]] == key[at[v]] && at[v - 1] < at[v]));
    for (int t = 1; t < m.ntri; t++) assert_true(least_vertex(&m, t - 1) <= least_vertex(&m, t));
    for (int h = 0; h < 3 * m.ntri; h++) assert_near((double)m.length[h], mesh_edge_length(&m, h), 1e-6); /* went along, as the places did */
    for (int v = 0; v < n; v++) key[v] = 0;
    mesh_sort(&m, 1, key, to); /* nothing to do */
    for (int v = 0; v < n; v++) assert_int_equal(to[v], v);
    mem_free(key);
    mem_free(to);
    mem_free(id);
    mem_free(at);
    mesh_free(&m);
}

static void what_comes_later_is_not_sorted(void **state)
{
    (void)state;
    Mesh m = mesh_of(shape_sphere(2));
    int n = m.nvert, h = 0;
    int32_t *key = NEW0(int32_t, n), *to = NEW(int32_t, n);
    assert_int_equal(m.nsorted, 0);
    mesh_sort(&m, 1, key, to);
    int v = mesh_split_edge(&m, 0, v_mid(m.pos[he_from(&m, 0)], m.pos[he_to(&m, 0)]), m.next_id++);
    assert_int_equal(m.nsorted, n);
    while (he_to(&m, h) == v || !mesh_can_collapse(&m, h)) h++;
    mesh_collapse_edge(&m, h, m.pos[he_from(&m, h)]); /* one of the old goes */
    mesh_compact(&m, NULL);
    assert_true(m.nvert == n && m.nsorted == n - 1);
    Mesh copy;
    mesh_init(&copy);
    mesh_copy(&copy, &m);
    assert_int_equal(copy.nsorted, n - 1);
    mesh_clear(&m);
    assert_int_equal(m.nsorted, 0);
    mem_free(key);
    mem_free(to);
    mesh_free(&m);
    mesh_free(&copy);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(appended_shapes_are_closed_components),
        cmocka_unit_test(check_finds_what_is_broken),
        cmocka_unit_test(components_can_be_dropped),
        cmocka_unit_test(split_puts_a_vertex_on_an_edge),
        cmocka_unit_test(collapse_joins_into_the_first_end),
        cmocka_unit_test(flip_turns_the_diagonal),
        cmocka_unit_test(tetrahedron_allows_nothing),
        cmocka_unit_test(sphere_collapses_to_a_tetrahedron),
        cmocka_unit_test(neck_is_not_pinched),
        cmocka_unit_test(double_triangles_do_not_arise),
        cmocka_unit_test(thousands_of_edits_keep_the_invariant),
        cmocka_unit_test(compact_says_where_everything_went),
        cmocka_unit_test(sort_puts_what_has_a_key_together),
        cmocka_unit_test(what_comes_later_is_not_sorted),
    };
    return cmocka_run_group_tests_name("mesh", tests, NULL, NULL);
}
