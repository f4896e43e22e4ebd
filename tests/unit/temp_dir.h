/* temp_dir.h: a directory of the test's own under TMPDIR, and files in it. */
#pragma once
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char temp_dir[512];

static inline int temp_open(void **state)
{
    const char *base = getenv("TMPDIR");
    (void)state;
    snprintf(temp_dir, sizeof temp_dir, "%s/twinmesh-test-XXXXXX", base && *base ? base : "/tmp");
    return mkdtemp(temp_dir) ? 0 : -1;
}

static inline int temp_close(void **state)
{
    (void)state;
    DIR *d = opendir(temp_dir);
    if (!d) return -1;
    for (struct dirent *e; (e = readdir(d)) != NULL;) {
        char path[1024];
        if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0) continue;
        snprintf(path, sizeof path, "%s/%s", temp_dir, e->d_name);
        remove(path);
    }
    closedir(d);
    return rmdir(temp_dir);
}

/* The path of a file in the directory; four at a time. */
static inline const char *temp_path(const char *name)
{
    static char path[4][1024];
    static int turn;
    turn = (turn + 1) % 4;
    snprintf(path[turn], sizeof path[turn], "%s/%s", temp_dir, name);
    return path[turn];
}

static inline const char *temp_write(const char *name, const void *data, size_t size)
{
    const char *path = temp_path(name);
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(data, 1, size, f) != size || fclose(f) != 0) abort();
    return path;
}
