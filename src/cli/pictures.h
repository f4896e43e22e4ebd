/* pictures.h: mesh --render: the PLYs of finished frames are named to a `twinmesh render -` of its own, which pictures them
 * while the next frames are solved. What goes wrong there costs no mesh. */
#pragma once
#include "cli/job.h"

typedef struct Pictures Pictures;

/* By the job's render and render_option. NULL with a sentence where no process can be had. */
Pictures *pictures_start(const MeshJob *job, Err *err);
/* A PLY that is there now. May wait, while render is many frames behind. */
void pictures_name(Pictures *p, const char *path);
/* Waits until all that were named are pictured. False where some are not: render has said why. NULL is allowed. */
bool pictures_finish(Pictures *p, Err *err);
