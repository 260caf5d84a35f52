/* L3: the scene file in a build without libcyaml. */
#include "scene/parts.h"

int gbg_scene_read_file(struct gbg_context *context, const char *path, struct gbg_scene **scene)
{
    *scene = NULL;
    return gbg_fail(context, GBG_E_UNBUILT,
                    "%.700s: this build reads no scene files; configure with -DGBG_WITH_CYAML=ON",
                    path);
}
