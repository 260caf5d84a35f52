/* Command: gamboge render. */
#include "command/command.h"

#ifdef GBG_WITH_CAIRO

#include <cairo-svg.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "command/frames.h"
#include "command/picture.h"
#include "core/file.h"

enum { PANELS_MOST = 64 };

struct panel {
    struct gbg_frames frames;
    struct gbg_picture picture;
    struct gbg_layout layout;
    int32_t *flags; /* colour by overlap: 0 took part, 1 did not */
    int64_t took_part;
    double left, top; /* corner on the canvas */
};

/* Panels in rows, a heading above them. */
struct sheet {
    struct panel *panel;
    int panels, columns;
    char names[GBG_PATH_MOST];
    const char *heading; /* NULL: none */
    double width, height, font;
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

static void colour_by_species(struct panel *panel)
{
    struct gbg_picture *picture = &panel->picture;
    const struct gbg_frames *frames = &panel->frames;
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

/* As in Carter (2016), figures 5.2 to 5.4: green took part in an overlap, red did not. A light
 * green and a dark red, which differ for people who do not see the colours too. */
static int colour_by_overlap(struct panel *panel)
{
    static const double green[3] = {0.49, 0.80, 0.36}, red[3] = {0.69, 0.07, 0.12};
    struct gbg_picture *picture = &panel->picture;
    const struct gbg_frames *frames = &panel->frames;
    panel->flags = calloc((size_t)frames->n + 1, sizeof *panel->flags);
    if (!panel->flags) {
        return gbg_complain(GBG_EXIT_FAILED, "no memory for %lld flags", (long long)frames->n);
    }
    int status =
        gbg_trajectory_overlapped(frames->trajectory, frames->frame, frames->n, panel->flags);
    if (status != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_USE, frames->context);
    }
    for (int64_t i = 0; i < frames->n; i++) {
        panel->took_part += panel->flags[i] != 0;
        panel->flags[i] = !panel->flags[i];
    }
    picture->group = panel->flags;
    picture->groups = 2;
    for (int c = 0; c < 3; c++) {
        picture->colour[0][c] = green[c];
        picture->colour[1][c] = red[c];
    }
    snprintf(picture->legend[0], GBG_LEGEND_TEXT, "took part in an overlap (%s)",
             gbg_count_text(panel->took_part));
    snprintf(picture->legend[1], GBG_LEGEND_TEXT, "did not (%s)",
             gbg_count_text(frames->n - panel->took_part));
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

static void write_title(struct panel *panel, int panels)
{
    const struct gbg_frames *frames = &panel->frames;
    char cut[64] = "";
    if (panels > 1) {
        snprintf(cut, sizeof cut, ", the box in %d pieces", panels);
    }
    snprintf(panel->picture.title, GBG_TITLE_TEXT,
             "%s   time %g, step %s   N = %s, packing %.4g%s%s", gbg_base_name(frames->path),
             frames->time, gbg_count_text(frames->step), gbg_count_text(frames->n),
             packing_of(frames), frames->dimension == 3 ? ", seen along z" : "", cut);
}

/* Opens the trajectory at `path` and says how its frame is drawn, in a cell of the given width. */
static int fill_panel(const struct gbg_arguments *arguments, const char *path, double width,
                      struct panel *panel)
{
    struct gbg_arguments of = *arguments;
    struct gbg_frames *frames = &panel->frames;
    struct gbg_picture *picture = &panel->picture;
    of.operand = path;
    int status = gbg_frames_open(&of, frames);
    status = status ? status : choose_frame(&of, frames);
    if (status) {
        return status;
    }
    picture->dimension = frames->dimension;
    picture->n = frames->n;
    picture->r = frames->r;
    picture->diameter = frames->diameter;
    for (int a = 0; a < 3; a++) {
        picture->length[a] = frames->length[a];
        picture->origin[a] = frames->origin[a];
    }
    if (gbg_text_of(arguments, "colour", "type")[0] == 'o') {
        status = colour_by_overlap(panel);
    } else {
        colour_by_species(panel);
    }
    gbg_picture_lay_out(picture, width, &panel->layout);
    write_title(panel, panel->layout.panels);
    return status;
}

/* Places the panels row by row; a row is as high as its highest panel. */
static void place_panels(struct sheet *sheet)
{
    double wide = sheet->width / sheet->columns, top = 0, high = 0;
    sheet->font = 1.4 * sheet->panel[0].layout.font;
    if (sheet->heading) {
        top = 2.2 * sheet->font;
    }
    for (int p = 0; p < sheet->panels; p++) {
        struct panel *panel = &sheet->panel[p];
        if (p > 0 && p % sheet->columns == 0) {
            top += high;
            high = 0;
        }
        panel->left = wide * (p % sheet->columns);
        panel->top = top;
        high = panel->layout.height > high ? panel->layout.height : high;
    }
    sheet->height = top + high;
}

/* 0, or -1 without memory. */
static int paint(const struct sheet *sheet, cairo_t *cairo)
{
    int status = 0;
    cairo_set_source_rgb(cairo, 1, 1, 1);
    cairo_paint(cairo);
    if (sheet->heading) {
        gbg_picture_heading(sheet->heading, sheet->width, sheet->font, cairo);
    }
    for (int p = 0; p < sheet->panels; p++) {
        const struct panel *panel = &sheet->panel[p];
        cairo_save(cairo);
        cairo_translate(cairo, panel->left, panel->top);
        status |= gbg_picture_draw(&panel->picture, &panel->layout, cairo);
        cairo_restore(cairo);
    }
    return status;
}

/* Draws into an image or an SVG file of that name; NULL, or what went wrong. */
static const char *draw_file(const struct sheet *sheet, int as_svg, const char *path)
{
    cairo_surface_t *surface =
        as_svg
            ? cairo_svg_surface_create(path, sheet->width, sheet->height)
            : cairo_image_surface_create(CAIRO_FORMAT_RGB24, (int)sheet->width, (int)sheet->height);
    cairo_t *cairo = cairo_create(surface);
    int short_of_memory = paint(sheet, cairo);
    cairo_status_t status = cairo_status(cairo);
    cairo_destroy(cairo);
    if (status == CAIRO_STATUS_SUCCESS && !as_svg) {
        status = cairo_surface_write_to_png(surface, path);
    }
    cairo_surface_finish(surface);
    status = status ? status : cairo_surface_status(surface);
    cairo_surface_destroy(surface);
    if (short_of_memory) {
        return "no memory";
    }
    return status == CAIRO_STATUS_SUCCESS ? NULL : cairo_status_to_string(status);
}

static int draw(const struct sheet *sheet, const char *out)
{
    struct gbg_context *context = sheet->panel[0].frames.context;
    char temporary[GBG_PATH_MOST];
    if (gbg_file_temporary(context, out, temporary, sizeof temporary) != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_FAILED, context);
    }
    const char *wrong = draw_file(sheet, gbg_has_suffix(out, ".svg"), temporary);
    if (wrong) {
        gbg_file_abandon(temporary);
        return gbg_complain(GBG_EXIT_FAILED, "cannot draw %s: %s", out, wrong);
    }
    if (gbg_file_commit(context, temporary, out) != GBG_OK) {
        gbg_file_abandon(temporary);
        return gbg_complain_library(GBG_EXIT_FAILED, context);
    }
    for (int p = 0; p < sheet->panels; p++) {
        const struct panel *panel = &sheet->panel[p];
        const struct gbg_frames *frames = &panel->frames;
        printf("%s: frame %lld of %s, %.0f x %.0f pixels", out, (long long)frames->frame,
               frames->path, panel->layout.width, panel->layout.height);
        if (panel->flags) {
            printf(", %s of %s took part in an overlap", gbg_count_text(panel->took_part),
                   gbg_count_text(frames->n));
        }
        putchar('\n');
    }
    return GBG_EXIT_DONE;
}

/* The operand and the trajectories of --beside, cut out of sheet->names. */
static int split_names(const struct gbg_arguments *arguments, struct sheet *sheet,
                       const char *names[PANELS_MOST])
{
    const char *beside = gbg_text_of(arguments, "beside", "");
    if (strlen(beside) >= sizeof sheet->names) {
        return gbg_complain(GBG_EXIT_USE, "--beside: %zu letters are too many", strlen(beside));
    }
    strcpy(sheet->names, beside);
    names[sheet->panels++] = arguments->operand;
    char *rest = NULL;
    for (char *name = strtok_r(sheet->names, ",", &rest); name; name = strtok_r(NULL, ",", &rest)) {
        if (sheet->panels == PANELS_MOST) {
            return gbg_complain(GBG_EXIT_USE, "--beside: a picture has at most %d panels",
                                PANELS_MOST);
        }
        names[sheet->panels++] = name;
    }
    return GBG_EXIT_DONE;
}

static int fill_sheet(const struct gbg_arguments *arguments, struct sheet *sheet)
{
    const char *names[PANELS_MOST], *out = gbg_text_of(arguments, "out", NULL);
    int status = split_names(arguments, sheet, names);
    for (int p = 0; status == GBG_EXIT_DONE && p < sheet->panels; p++) {
        status = gbg_check_output(out, names[p]);
    }
    if (status) {
        return status;
    }
    int columns = (int)gbg_integer_of(arguments, "columns", 3);
    sheet->columns = columns < sheet->panels ? columns : sheet->panels;
    sheet->width = (double)gbg_integer_of(arguments, "width", 1200);
    sheet->heading = gbg_text_of(arguments, "title", NULL);
    sheet->panel = calloc((size_t)sheet->panels, sizeof *sheet->panel);
    if (!sheet->panel) {
        return gbg_complain(GBG_EXIT_FAILED, "no memory for %d panels", sheet->panels);
    }
    for (int p = 0; status == GBG_EXIT_DONE && p < sheet->panels; p++) {
        status =
            fill_panel(arguments, names[p], floor(sheet->width / sheet->columns), &sheet->panel[p]);
    }
    return status;
}

int gbg_command_render(const struct gbg_arguments *arguments)
{
    const char *out = gbg_text_of(arguments, "out", NULL);
    struct sheet sheet = {0};
    if (!gbg_has_suffix(out, ".png") && !gbg_has_suffix(out, ".svg")) {
        return gbg_complain(GBG_EXIT_USE, "--out %s: the name must end in .png or .svg", out);
    }
    int status = fill_sheet(arguments, &sheet);
    if (status == GBG_EXIT_DONE) {
        place_panels(&sheet);
        status = draw(&sheet, out);
    }
    for (int p = 0; sheet.panel && p < sheet.panels; p++) {
        free(sheet.panel[p].flags);
        gbg_frames_close(&sheet.panel[p].frames);
    }
    free(sheet.panel);
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
