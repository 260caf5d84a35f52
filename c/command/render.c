/* Command: gamboge render. */
#include "command/command.h"

#ifdef GBG_WITH_CAIRO

#include <cairo-svg.h>
#include <stdlib.h>

#include "command/frames.h"
#include "command/picture.h"
#include "core/file.h"

struct rendering {
    struct gbg_frames frames;
    struct gbg_picture picture;
    int32_t *flags; /* colour by overlap: 0 took part, 1 did not */
    double width;
};

/* Frames count from 0; -1 is the last. */
static int choose_frame(const struct gbg_arguments *arguments, struct gbg_frames *frames)
{
    int64_t frame = gbg_integer_of(arguments, "frame", -1);
    if (frames->frames == 0) {
        return gbg_complain(GBG_EXIT_USE, "%s holds no frame", frames->path);
    }
    frame = frame == -1 ? frames->frames - 1 : frame;
    if (frame >= frames->frames) {
        return gbg_complain(GBG_EXIT_USE, "--frame %lld: the frames of %s are 0 to %lld",
                            (long long)frame, frames->path, (long long)frames->frames - 1);
    }
    return gbg_frames_load(frames, frame);
}

static void colour_by_species(struct rendering *rendering)
{
    struct gbg_picture *picture = &rendering->picture;
    const struct gbg_frames *frames = &rendering->frames;
    picture->group = frames->species;
    picture->groups = frames->n_species;
    for (int s = 0; s < frames->n_species; s++) {
        char name[32];
        gbg_frames_species_name(frames, s, sizeof name, name);
        gbg_palette(s, picture->colour[s]);
        snprintf(picture->legend[s], GBG_LEGEND_TEXT, "%s (%s)", name,
                 gbg_count_text(frames->count[s]));
    }
}

/* Carter's figures 5.2 to 5.4: green took part in an overlap, red did not. */
static int colour_by_overlap(struct rendering *rendering)
{
    static const double green[3] = {0.0, 0.62, 0.35}, red[3] = {0.84, 0.19, 0.15};
    struct gbg_picture *picture = &rendering->picture;
    const struct gbg_frames *frames = &rendering->frames;
    int64_t took_part = 0;
    rendering->flags = calloc((size_t)frames->n + 1, sizeof *rendering->flags);
    if (!rendering->flags) {
        return gbg_complain(GBG_EXIT_FAILED, "no memory for %lld flags", (long long)frames->n);
    }
    int status =
        gbg_trajectory_overlapped(frames->trajectory, frames->frame, frames->n, rendering->flags);
    if (status != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_USE, frames->context);
    }
    for (int64_t i = 0; i < frames->n; i++) {
        took_part += rendering->flags[i] != 0;
        rendering->flags[i] = !rendering->flags[i];
    }
    picture->group = rendering->flags;
    picture->groups = 2;
    for (int c = 0; c < 3; c++) {
        picture->colour[0][c] = green[c];
        picture->colour[1][c] = red[c];
    }
    snprintf(picture->legend[0], GBG_LEGEND_TEXT, "took part in an overlap (%s)",
             gbg_count_text(took_part));
    snprintf(picture->legend[1], GBG_LEGEND_TEXT, "did not (%s)",
             gbg_count_text(frames->n - took_part));
    return GBG_EXIT_DONE;
}

static double packing_of(const struct gbg_frames *frames)
{
    double cores = 0, volume = 1;
    for (int64_t i = 0; i < frames->n; i++) {
        cores += gbg_core_size(frames->dimension, frames->diameter[i]);
    }
    for (int a = 0; a < frames->dimension; a++) {
        volume *= frames->length[a];
    }
    return cores / volume;
}

static void write_title(struct rendering *rendering, int panels)
{
    const struct gbg_frames *frames = &rendering->frames;
    char cut[64] = "";
    if (panels > 1) {
        snprintf(cut, sizeof cut, ", the box in %d pieces", panels);
    }
    snprintf(rendering->picture.title, GBG_TITLE_TEXT,
             "%s   time %g, step %s   N = %s, packing %.4g%s%s", gbg_base_name(frames->path),
             frames->time, gbg_count_text(frames->step), gbg_count_text(frames->n),
             packing_of(frames), frames->dimension == 3 ? ", seen along z" : "", cut);
}

static int draw(struct rendering *rendering, const char *out)
{
    struct gbg_layout layout;
    struct gbg_context *context = rendering->frames.context;
    char temporary[GBG_PATH_MOST];
    if (gbg_file_temporary(context, out, temporary, sizeof temporary) != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_FAILED, context);
    }
    gbg_picture_lay_out(&rendering->picture, rendering->width, &layout);
    write_title(rendering, layout.panels);
    int as_svg = gbg_has_suffix(out, ".svg");
    cairo_surface_t *surface =
        as_svg
            ? cairo_svg_surface_create(temporary, layout.width, layout.height)
            : cairo_image_surface_create(CAIRO_FORMAT_RGB24, (int)layout.width, (int)layout.height);
    cairo_t *cairo = cairo_create(surface);
    int short_of_memory = gbg_picture_draw(&rendering->picture, &layout, cairo);
    cairo_status_t status = cairo_status(cairo);
    cairo_destroy(cairo);
    if (status == CAIRO_STATUS_SUCCESS && !as_svg) {
        status = cairo_surface_write_to_png(surface, temporary);
    }
    cairo_surface_finish(surface);
    status = status ? status : cairo_surface_status(surface);
    cairo_surface_destroy(surface);
    if (status != CAIRO_STATUS_SUCCESS || short_of_memory) {
        gbg_file_abandon(temporary);
        return gbg_complain(GBG_EXIT_FAILED, "cannot draw %s: %s", out,
                            short_of_memory ? "no memory" : cairo_status_to_string(status));
    }
    if (gbg_file_commit(context, temporary, out) != GBG_OK) {
        gbg_file_abandon(temporary);
        return gbg_complain_library(GBG_EXIT_FAILED, context);
    }
    printf("%s: frame %lld of %s, %.0f x %.0f pixels\n", out, (long long)rendering->frames.frame,
           rendering->frames.path, layout.width, layout.height);
    return GBG_EXIT_DONE;
}

static int render(const struct gbg_arguments *arguments, struct rendering *rendering)
{
    const char *out = gbg_text_of(arguments, "out", NULL);
    struct gbg_frames *frames = &rendering->frames;
    if (!gbg_has_suffix(out, ".png") && !gbg_has_suffix(out, ".svg")) {
        return gbg_complain(GBG_EXIT_USE, "--out %s: the name must end in .png or .svg", out);
    }
    int status = gbg_check_output(out, arguments->operand);
    status = status ? status : gbg_frames_open(arguments, frames);
    status = status ? status : choose_frame(arguments, frames);
    if (status) {
        return status;
    }
    struct gbg_picture *picture = &rendering->picture;
    picture->dimension = frames->dimension;
    picture->n = frames->n;
    picture->r = frames->r;
    picture->diameter = frames->diameter;
    for (int a = 0; a < 3; a++) {
        picture->length[a] = frames->length[a];
        picture->origin[a] = frames->origin[a];
    }
    rendering->width = (double)gbg_integer_of(arguments, "width", 1200);
    if (gbg_text_of(arguments, "colour", "type")[0] == 'o') {
        status = colour_by_overlap(rendering);
    } else {
        colour_by_species(rendering);
    }
    return status ? status : draw(rendering, out);
}

int gbg_command_render(const struct gbg_arguments *arguments)
{
    struct rendering rendering = {.flags = NULL};
    int status = render(arguments, &rendering);
    free(rendering.flags);
    gbg_frames_close(&rendering.frames);
    return status;
}

#else

int gbg_command_render(const struct gbg_arguments *arguments)
{
    return gbg_complain(GBG_EXIT_FAILED,
                        "%s: this build cannot draw; configure with -DGBG_WITH_CAIRO=ON",
                        arguments->operand);
}

#endif
